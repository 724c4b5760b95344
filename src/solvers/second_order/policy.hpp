// Every tuned number of the methods that factor, with its unit and its reason. tools/check_policy.py finds
// numbers elsewhere.
#pragma once
#include <cstddef>

namespace amontons::second_order {

struct Policy {
  // Rounding (relative): of a best residual, and of sqrt(t) at the end of the path of Coulomb's law. A
  // proximal term of this size keeps the pivots of a singular A.
  double rounding = 1e-12;

  // Interior point.

  // Step (relative to the distance to the boundary): on the boundary the scaling does not exist, and a step
  // that ends much nearer leaves the next one no room.
  double fraction = 0.995;
  // Collapse (ratio): growth of the residual over the best one, or shortening of a step, that ends the path.
  // While it converges the residual may rise for a few steps. At the end W is all rounding, and the residual
  // rises by many powers of ten. A shorter step comes from an iterate squeezed against the boundary, as later
  // ones would.
  double collapse = 1e4;
  // Eigenvalue (units of the block): a starting point with a smaller one is pushed inside.
  double start_margin = 1e-3;

  // Path of Coulomb's law.

  // Curve parameter (units of t): below it a stall is due to rounding, as R' mixes digits (algorithm.md, 37).
  // Newton's method continues from there.
  double near_the_end = 1e-8;
  // Steps (count): without a better residual there; the path then ends.
  std::size_t most_stale = 6;

  // Newton's method.

  // Iterations (count): of the first-order method after a failed step, less than a factorisation costs. They
  // double with every consecutive failure.
  std::size_t shortest_burst = 30;
  // Iterations (count): up to this; if the faces stay wrong, a factorisation every so many costs little.
  std::size_t longest_burst = 2000;
  // Halvings of a step (count): F is no gradient, and a step that fails at an eighth of its length rarely
  // succeeds at less.
  int halvings = 3;
  // Residual (relative to the present one): a step that leaves more is a failure, as a burst achieves more.
  double sufficient = 0.9;
  // Inexactness (relative to the residual): of a Newton step, by its proximal term and by GMRES. Both vanish
  // with the residual, so that steps become Newton steps. A step of three correct digits reduces the residual
  // by up to three.
  double inexact = 1e-3;
  // Proximal term (relative): a larger one would shorten the steps far from the solution.
  double most_proximal = 1e-6;
};
// Size (vectors, stored twice): of the Krylov space. If so many do not give three digits, the burst after a
// failed step is a better use of the time.
inline constexpr int krylov = 40;
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
extern Policy policy;

}  // namespace amontons::second_order
