// Every tuned number of the methods that factor, with its unit and its reason. tools/check_policy.py finds
// numbers elsewhere.
#pragma once
#include <cstddef>

#include "amontons/base/policy.hpp"

namespace amontons::second_order {

struct Policy {
  // Rounding (relative): of a best residual, and of sqrt(t) at the end of the path of Coulomb's law. A
  // proximal term of this size keeps the pivots of a singular A. In the direct way also the natural map that
  // bilateral rows may leave, the floor of their pivots in K, and that of the diagonal of W.
  // Redundant rows then have a pivot far above the terms that cancel there.
  double rounding = 1e-12;

  // Interior point.

  // Step (relative to the distance to the boundary): on the boundary the scaling does not exist, and a step
  // that ends much nearer leaves the next one no room. With 0.99 B3_s10 stalls (test_reference_files).
  double fraction = 0.995;
  // Collapse (ratio): growth of the residual over the best one, or shortening of a step, that ends the path.
  // While it converges the residual may rise for a few steps. At the end W is all rounding, and the residual
  // rises by many powers of ten. A shorter step comes from an iterate squeezed against the boundary, as later
  // ones would.
  double collapse = 1e4;

  // Newton's method.

  // Iterations (count): of a first-order method after a failed step, or after a path with the De Saxce term
  // held. If the faces stay wrong, a factorisation every so many costs little. With 100 a wall at rest
  // (B4_s60) stalls.
  std::size_t burst = 300;
  // Halvings of a step (count): F is no gradient, and a step that fails at an eighth of its length rarely
  // succeeds at less.
  int halvings = 3;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named = name_policy("second_order", {{"fraction", &policy.fraction},
                                                       {"collapse", &policy.collapse},
                                                       {"rounding", &policy.rounding},
                                                       {"burst", &policy.burst},
                                                       {"halvings", &policy.halvings}});

}  // namespace amontons::second_order
