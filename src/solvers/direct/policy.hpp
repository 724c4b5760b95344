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

  // Rounding (relative): the natural map that bilateral rows may leave, the smallest proximal term, and the
  // least compliance of a bilateral row in K. Redundant rows then have a pivot far above the terms that
  // cancel there.
  double rounding = 1e-13;
  // Natural map (tolerances): where islands stop. Newton steps cost microseconds, and a scene at rest starts
  // its next step with the answer (test_rest).
  double aim = 1e-5;
  // Natural map (tolerances): target of the islands; the remainder is left to the rounding of W.
  double island_share = 0.9;
  // Natural map (tolerances): target of a first-order method on the constrained bodies; the remainder is left
  // to the rounding of K.
  double constrained_share = 0.999;
  // Refinements (count): of bilateral impulses. The least compliance of K slows their convergence if links
  // have 1e-8 of the mass that they carry (test_light_bodies).
  int refinements = 6;
  // Rounds (count): islands are solved again for the error of the last round in the true problem; masses of
  // 1e8 : 1e-8 need three. Off: 1.
  int most_rounds = 3;
  // Mobility (relative to the largest): floor of the diagonal of W for immobile blocks.
  double least_diagonal = 1e-14;

  // Search for faces.

  // Residual (relative to that of zero impulses): a start above it is replaced by zero.
  double far_off = 10;
  // Newton steps (count): at the faces of the start, most of which are right.
  std::size_t steps_at_once = 10;
  // Newton steps (count): that may pass without a better x.
  std::size_t stale_at_once = 4;
  // Newton steps (ratio): of the careful search to those at once, because its proximal term takes longer to
  // fall. Off: 0.
  std::size_t times_carefully = 2;
  // Proximal term (relative to the diagonal of W): makes the matrix regular if contacts outnumber the degrees
  // of freedom of the bodies. It changes their impulses by no more than the tolerance.
  double proximal_at_once = 1e-7;
  // Proximal term (relative to the diagonal of W): in the careful search. Redundant contacts that oppose
  // slips of 1e-7 m/s keep their impulses (test_scenes, jammed dominoes).
  double proximal_careful = 1e-3;
  // Proximal term (factor): after a step without a better x; its inverse after a slow step.
  double proximal_rise = 10;
  // Natural map (factor per step): a step that gains less is slow, as the proximal term holds it back.
  double slow_step = 0.1;

  // Work.

  // Work (multiplications): of an island without the curve, beside twice the cube of its rows; 5 ms.
  std::size_t most_island_work = 1'000'000;
  // Work (multiplications): equivalent of a projection or natural map per row.
  std::size_t multiplications_per_row = 30;
  // Work (multiplications): between two checks of the budget, 10 us.
  std::size_t unwatched_work = 5'000;
  // Steps (count): along a curve that bends little.
  std::size_t usual_curve_steps = 15;
  // Steps (count): after which a curve is abandoned.
  std::size_t most_curve_steps = 150;
  // Work left (relative): a curve that would take a larger share is not begun.
  // Off: 0.
  double share_of_curve = 0.4;
  // Parameter t (relative): end of the curve, below the rounding of any residual.
  double end_of_curve = 1e-30;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
extern Policy policy;

}  // namespace amontons::direct
