// Velocities and momenta of rigid bodies about the reference point of their tree.
//
// A point of the world would cost digits in proportion to the distance of the tree from it.
#pragma once
#include "amontons/base/math.hpp"

namespace amontons {

// A velocity field of a rigid body: of the point at the reference of its tree, and angular. Or a wrench: a
// force, and its moment about that point. World axes.
struct Flow {
  Vec3 linear, angular;
};

inline Flow& operator+=(Flow& a, const Flow& b) {
  a.linear += b.linear;
  a.angular += b.angular;
  return a;
}
inline Flow operator*(double s, const Flow& a) { return {s * a.linear, s * a.angular}; }
inline Flow operator-(const Flow& a, const Flow& b) { return {a.linear - b.linear, a.angular - b.angular}; }
inline double power(const Flow& wrench, const Flow& v) {
  return dot(wrench.linear, v.linear) + dot(wrench.angular, v.angular);
}
// The flow of a velocity at a point, seen at the reference; `arm` from the reference to the point.
inline Flow from_point(const Vec3& linear, const Vec3& angular, const Vec3& arm) {
  return {linear - cross(angular, arm), angular};
}

}  // namespace amontons
