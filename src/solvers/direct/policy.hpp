// Every tuned number of the direct way, with its unit, its reason, and the test or benchmark that protects
// it. tools/check_policy.py finds numbers elsewhere.
#pragma once
#include <cstddef>

#include "amontons/base/budget.hpp"

namespace amontons::direct {

struct Policy {
  // Where the direct way applies.

  // Size (rows of an island): at this size a dense factorisation takes 1 ms, about as long as a first-order
  // method. With 300 stacks of plates took 3 times as long, 15 times at worst.
  std::size_t most_rows = 180;
  // Size (rows of an island): with more bilateral rows than others, as in robots, first-order methods take
  // long.
  std::size_t most_rows_on_joints = 300;
  // Work (multiplications): limit of a factorisation of K, 10 ms. Trees need 2000 per body, loops that cross
  // may cause much fill.
  double most_factor_work = 2e7;

  // Accuracy.

  // Rounding (relative): the natural map that bilateral rows may leave, the least compliance of a bilateral
  // row in K, and the floor of the diagonal of W for immobile blocks. Redundant rows then have a pivot far
  // above the terms that cancel there.
  double rounding = 1e-13;
  // Natural map (tolerances): where islands stop. Newton steps cost microseconds, and a scene at rest starts
  // its next step with the answer (test_rest).
  double aim = 1e-5;
  // Natural map (tolerances): target of islands, and of a first-order method on constrained bodies; the
  // remainder is left to the rounding of W and of K.
  double reduced_share = 0.9;
  // Refinements (count): of bilateral impulses. The least compliance of K slows their convergence if links
  // have 1e-8 of the mass that they carry (test_light_bodies).
  // Off: 0.
  int refinements = 6;
  // Rounds (count): islands are solved again for the error of the last round in the true problem; masses of
  // 1e8 : 1e-8 need three. Off: 1.
  int most_rounds = 3;

  // Search for faces.

  // Newton steps (count): at the faces of the start, most of which are right.
  std::size_t newton_steps = 10;
  // Newton steps (count): that may pass without a better x.
  std::size_t stale_steps = 4;
  // Proximal term (relative to the diagonal of W): makes the matrix regular if contacts outnumber the degrees
  // of freedom of the bodies. It changes their impulses by no more than the tolerance.
  double proximal = 1e-7;

  // Work.

  // Work (multiplications): of an island without the curve, beside twice the cube of its rows; 5 ms.
  std::size_t most_island_work = 1'000'000;
  // Work (multiplications): equivalent of a projection or natural map per row.
  std::size_t multiplications_per_row = 30;
  // Work (multiplications): between two checks of the budget, 10 us.
  std::size_t unwatched_work = 5'000;
  // Steps (count): along a curve, for which the work left must suffice; a curve that bends little takes 15.
  // Off: 1e9.
  std::size_t curve_steps_in_reserve = 40;
  // Steps (count): after which a curve is abandoned.
  std::size_t most_curve_steps = 150;
  // Parameter t (relative): end of the curve, below the rounding of any residual.
  double end_of_curve = 1e-30;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
extern Policy policy;

}  // namespace amontons::direct
