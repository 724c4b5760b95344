// Every tuned number of the methods that factor, with its unit and its reason. tools/check_policy.py finds
// numbers elsewhere.
#pragma once
#include <cstddef>

#include "amontons/base/policy.hpp"

namespace amontons::second_order {

struct Policy {
  // Interior point.

  // Step (relative to the distance to the boundary): on the boundary the scaling does not exist, and a step
  // that ends much nearer leaves the next one no room. With 0.99 B3_s10 stalls (test_reference_files).
  double fraction = 0.995;

  // Newton's method.

  // Iterations (count): of a first-order method after a failed step, or after a path with the De Saxce term
  // held. If the faces stay wrong, a factorisation every so many costs little. With 100 a wall at rest
  // (B4_s60) stalls.
  std::size_t burst = 300;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named =
    name_policy("second_order", {{"fraction", &policy.fraction}, {"burst", &policy.burst}});

}  // namespace amontons::second_order
