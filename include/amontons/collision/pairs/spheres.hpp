#pragma once
#include "amontons/collision/narrow/contact_point.hpp"

namespace amontons {

// The point of two spheres about these centres, at any distance. It lies half-way between the surfaces, at
// (a + b) / 2 plus half of the difference of the radii along the normal. In this form swapped spheres have
// the same point, to the bit. On one centre no direction is right; the chosen one is fixed in b, whose
// rotation it needs.
inline ContactPoint touch_spheres(const Vec3& a, double radius_a, const Vec3& b, double radius_b,
                                  const Quat& rotation_b) {
  const Vec3 offset = a - b;
  const double distance = norm(offset);
  const Vec3 n = distance > 0 ? offset / distance : rotate(rotation_b, {0, 0, 1});
  return {0.5 * (a + b) + (0.5 * (radius_b - radius_a)) * n, n, distance - (radius_a + radius_b)};
}

}  // namespace amontons
