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
  // whose heights differ by less are level, and points that are nearer are the same.
  double level = 0.01;

  // Size (points): smaller groups of one normal keep all points.
  std::size_t few = 4;
  // Cosine (1): of normals of one group. 8 degrees are less than the angle at edges of a body or of the
  // ground, more than that between triangles of a fine mesh.
  double one_normal = 0.99;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named = name_policy("contacts", {{"allowance", &policy.allowance},
                                                   {"level", &policy.level},
                                                   {"few", &policy.few},
                                                   {"one_normal", &policy.one_normal}});

}  // namespace amontons::contacts
