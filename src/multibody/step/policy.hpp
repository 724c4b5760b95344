// Every tuned number of the step, with its unit, its reason, and the test or benchmark that protects it.
// tools/check_policy.py finds numbers elsewhere.
#pragma once
#include <cstddef>

#include "amontons/base/policy.hpp"

namespace amontons::step {

struct Policy {
  // Budget.

  // Iterations (count): made even out of budget; unsupported bodies would sink into each other and cost more
  // later. Also sweeps of the safe step over the fixed contacts of a body in a corner, and rounds with spins
  // limited in between.
  std::size_t few_iterations = 10;
  // Repetitions (count): limit of reflections in a step, and of iterations of a solve of positions. A row of
  // balls transmits an impact, one reflection per ball (test_scenes).
  std::size_t most_repeats = 100;
  // Work (products with a block, per block): limit of a step, 0.8 ms per contact or joint (test_step_limits).
  // Iterations of first-order methods do not grow with the size of large steps.
  double work_per_block = 4e4;
  // Time or work left (relative): limit of impacts, of position solves and of one solve. Later ones, the look
  // ahead and the safe step keep the rest. At most as much is reserved for work after the solve. With 0.7 9
  // of 200 steps of a wall with a budget of 25 ms end late (benchmarks/budgets.py).
  double share_of_part = 0.5;

  // Solve.

  // Residual (tolerances): a start above it is solved again by the direct way, to rounding, in microseconds.
  // Four tests of creep need it.
  // Off: 1.
  double direct_start = 1e-2;
  // Looks ahead (count): each followed by a solve if it finds something. With one the grains of a hopper
  // overlap by 9 mm instead of 2 um (test_bands), and 1000 spheres by 0.87 % of Model::length instead of 0.20
  // % (measured on 378da62). Off: 1.
  int most_looks = 4;
  // Velocity (relative to g h): turns of contacts below it are ignored.
  // Off: 1e30.
  double least_turn = 1e-2;

  // Closed contacts.

  // Position error (relative to Model::length): smaller errors are not corrected, so that resting bodies do
  // not move. Beyond it no contact closes, because the recovery does: a gap that is too narrow would take a
  // body in farther. Also the tolerance of a correction (relative): later ones follow, and one factorisation
  // solves linear systems to rounding. A pile at rest beside a robot would add to its iterations with 1e-5
  // and with 1e-3 (test_rest_of_islands).
  double allowed_error = 1e-4;
  // Slack of gaps (steps of drift at the tolerance): smaller differences of gaps are ignored in large
  // problems. A wall at rest takes 105,251 iterations instead of 418 without it (measured on 378da62).
  // Off: 0.
  double steps_of_slack = 40;
  // Size (rows): smaller problems are solved to rounding and need no slack. Larger systems of positions get a
  // first-order method, which is stopped early, and springs have no rows there.
  std::size_t few_rows = 300;

  // Energy and second order.

  // Change (relative to the velocity or force): above it something jumps. A slip of such a size is removed
  // completely. A smooth motion that changes by a tenth per step has a twentieth.
  double rough = 0.6;
  // Sag of locked rows (relative): share of the last step's that is removed; the rest keeps redundant rows
  // determinate. Without it belts lose their last digits (test_ropes), with all of it redundant loops gain
  // energy (test_linkages).
  double remembered_sag = 0.9;

  // Light bodies.

  // Velocity error (relative to the velocity of a block): counts as wrong above it; two random scenes break
  // without it.
  // Off: 1e30.
  double wrong = 0.05;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named = name_policy("step", {{"few_iterations", &policy.few_iterations},
                                               {"most_repeats", &policy.most_repeats},
                                               {"work_per_block", &policy.work_per_block},
                                               {"share_of_part", &policy.share_of_part},
                                               {"direct_start", &policy.direct_start},
                                               {"most_looks", &policy.most_looks},
                                               {"least_turn", &policy.least_turn},
                                               {"allowed_error", &policy.allowed_error},
                                               {"steps_of_slack", &policy.steps_of_slack},
                                               {"few_rows", &policy.few_rows},
                                               {"rough", &policy.rough},
                                               {"remembered_sag", &policy.remembered_sag},
                                               {"wrong", &policy.wrong}});

}  // namespace amontons::step
