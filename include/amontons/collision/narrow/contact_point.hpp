#pragma once
#include "amontons/base/math.hpp"

namespace amontons {

// One point of a contact manifold, in world coordinates. The contact constraint there is gap >= 0, where gap
// changes at the rate <normal, v_A - v_B> of the velocities of the two bodies at `point`.
struct ContactPoint {
  Vec3 point;   // half-way between the two surfaces, m
  Vec3 normal;  // unit, from shape B to shape A
  double gap;   // signed distance of the surfaces along the normal, m; negative when they overlap
};

}  // namespace amontons
