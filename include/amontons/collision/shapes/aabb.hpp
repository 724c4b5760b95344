#pragma once
#include <algorithm>
#include <limits>

#include "amontons/base/math.hpp"

namespace amontons {

// A box along the axes of its frame, boundary included; planes have infinite boxes.
struct Aabb {
  Vec3 lower, upper;
};

// Two boxes overlap unless one ends before the other begins on some axis. Touching counts. Every comparison
// with a NaN is false, so a box with a NaN bound overlaps nothing.
inline bool is_overlap(const Aabb& a, const Aabb& b) {
  return a.lower.x <= b.upper.x && b.lower.x <= a.upper.x && a.lower.y <= b.upper.y &&
         b.lower.y <= a.upper.y && a.lower.z <= b.upper.z && b.lower.z <= a.upper.z;
}

// The empty box, to which include() adds.
inline Aabb empty_box() {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  return {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
}
// Widens the box, if necessary, to contain p.
inline void include(Aabb& box, const Vec3& p) {
  for (int i = 0; i < 3; ++i) {
    box.lower[i] = std::min(box.lower[i], p[i]);
    box.upper[i] = std::max(box.upper[i], p[i]);
  }
}

}  // namespace amontons
