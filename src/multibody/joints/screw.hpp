#pragma once
#include "amontons/base/math.hpp"

namespace amontons {

// A twist (velocity of a point, angular velocity) or a wrench (force, torque about that point). The product
// of a wrench and a twist is power.
struct Screw {
  Vec3 linear, angular;
};
constexpr double dot(const Screw& a, const Screw& b) {
  return dot(a.linear, b.linear) + dot(a.angular, b.angular);
}
constexpr Screw operator*(double s, const Screw& a) { return {s * a.linear, s * a.angular}; }

}  // namespace amontons
