// Every tuned number of contacts, with its unit, its reason, and the test that protects it.
// tools/check_policy.py finds numbers elsewhere.
#pragma once
#include <cstddef>

#include "amontons/base/policy.hpp"

namespace amontons::contacts {

struct Policy {
  // Lengths, relative to the margin.

  // Overlap (relative): a smaller one is no error, because contacts close gaps to zero only within rounding
  // and the tolerance. Redundant points are considered up to a gap of this size. The neighbour of a rim
  // begins so near.
  double allowance = 0.1;
  // Distance (relative): far above the error of a resting body, far below the purpose of a margin. Faces
  // whose heights differ by less are level, points that are nearer are the same, and a redundant point may
  // overlap by so much.
  double level = 0.01;
  // Overlap (relative): that a redundant point may have. Without it a sole has more points than it needs
  // (test_contact_points). A body on a rough sole that stands alternately on different points would never
  // rest with more.
  double least_overlap = 1e-4;

  // Size (points): smaller groups of one normal keep all points.
  std::size_t few = 4;
  // Cosine (1): of normals of one group. 8 degrees are less than the angle at edges of a body or of the
  // ground, more than that between triangles of a fine mesh.
  double one_normal = 0.99;

  // Turns.

  // Turn (rad): of a pair in a step, below which it is neglected. A point at the distance r from the axis
  // departs from its tangent by r a^2 / 2, half a millionth of r.
  double least_turn = 1e-3;
  // Angle (rad): between directions that are the same, or that are perpendicular. With 1e-3 a rolling
  // ellipsoid feels seams (test_seams).
  double same_direction = 1e-4;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named = name_policy("contacts", {{"allowance", &policy.allowance},
                                                   {"level", &policy.level},
                                                   {"least_overlap", &policy.least_overlap},
                                                   {"few", &policy.few},
                                                   {"one_normal", &policy.one_normal},
                                                   {"least_turn", &policy.least_turn},
                                                   {"same_direction", &policy.same_direction}});

}  // namespace amontons::contacts
