// Every tuned number of the direct way. A number enters with its unit, its reason, and the test or benchmark
// that protects it; tools/check_policy.py finds numbers elsewhere.
#pragma once
#include <cstddef>

#include "amontons/base/patience.hpp"

namespace amontons::direct {

// Where the direct way applies.

// Rows of an island: a dense matrix of 180 rows takes 1 ms to factor, a first-order method about as long. 300
// rows made stacks of plates 3 times slower, 15 at worst (benchmarks/ablation.py).
inline constexpr std::size_t most_rows = 180;
// Rows of an island in a problem with more bilateral rows than others, which take first-order methods long:
// robots.
inline constexpr std::size_t most_rows_on_joints = 300;
// Multiplications of a factorisation of K: 10 ms. Trees need 2000 for each body, loops that cross may fill it
// up.
inline constexpr double most_factor_work = 2e7;

// Accuracy.

// Compliance (relative to diag(A) of the row): least of a bilateral row in K. Redundant rows then have a
// pivot far above the rounding of what cancels there; refinement takes back what it changes.
inline constexpr double least_compliance = 1e-13;
// Tolerance (relative): islands aim this far below it. Steps of Newton's method cost microseconds, and a
// scene that rests starts its next step with the answer (tests/physics/test_rest.py).
inline constexpr double aim = 1e-5;
// Tolerance (relative): what islands are asked for; the rest is left to the rounding of W.
inline constexpr double island_share = 0.9;
// Tolerance (relative): what a first-order method on the constrained bodies is asked for; the rest is left to
// the rounding of K.
inline constexpr double constrained_share = 0.999;
// Natural map (relative to that at zero): rounding that bilateral rows may leave.
inline constexpr double bilateral_rounding = 1e-13;
// Refinements (count) of bilateral impulses: the least compliance of K slows convergence down where links are
// 1e-8 of what they carry (tests/physics/test_light_bodies.py).
inline constexpr int refinements = 6;
// Rounds (count): solves of the islands, each for what the last one left on the true problem (defect
// correction); masses of 1e8 : 1e-8 need three (tests/cpp/test_elimination.cpp).
inline constexpr int most_rounds = 3;
// diag(W) (relative to the largest): floor for blocks that nothing moves; rounding of W.
inline constexpr double least_diagonal = 1e-14;

// Search for faces.

// Residual (relative to that of no impulses): above it, a start is further off than nothing.
inline constexpr double far_off = 10;
// Steps (count): at the faces of the start, and how many of them may bring no better x. Most starts need one
// to three.
inline constexpr std::size_t steps_at_once = 10, stale_at_once = 4;
// Steps (count) of the careful search, whose proximal term takes twice as many to fall.
inline constexpr std::size_t steps_careful = 20, stale_careful = 8;
// Proximal term (relative to diag(W)): makes a regular matrix where contacts outnumber the freedoms of the
// bodies, and changes their distribution by no more than the tolerance.
inline constexpr double proximal_at_once = 1e-7;
// Proximal term (relative to diag(W)) of the careful search: redundant contacts that oppose slips of 1e-7 m/s
// stay.
inline constexpr double proximal_careful = 1e-3;
// Proximal term (factors): rise after a step without a better x, fall after one that is slower than
// `slow_step`.
inline constexpr double proximal_rise = 10, proximal_fall = 0.1, slow_step = 0.1;
// Gradient steps (count) before faces are looked for once more; a tenth of the cost of the curve for 30 rows.
inline constexpr std::size_t descent = 100;
// Bound of the curvature (factor per step): it may fall again (first_order/apgd.cpp).
inline constexpr double forget_curvature = 0.95;
// Proximal term (relative to diag(W)): from rounding to the size of W.
inline constexpr double smallest_proximal = 1e-13, largest_proximal = 1;

// Work.

// Multiplications (count): of an island beside the curve, and times m^3 for large ones; about 5 ms.
inline constexpr std::size_t most_island_work = 1'000'000, most_island_work_per_cube = 2;
// Multiplications (count) in the time of a projection or natural map of a row.
inline constexpr std::size_t multiplications_per_row = 30;
// Multiplications (count) between two looks at the budget: 10 us.
inline constexpr std::size_t unwatched_work = 5'000;
// Multiplications (count) of short rows in a unit of work, half of those of dense kernels.
inline constexpr double island_multiplications = 0.5 * Patience::multiplications;
// Steps (count) along a curve that bends little, and after which it is given up.
inline constexpr std::size_t usual_curve_steps = 15, most_curve_steps = 150;
// Work left (relative): a curve that would take more is not begun.
inline constexpr double share_of_curve = 0.4;
// t: where the curve has ended, below the rounding of any residual.
inline constexpr double end_of_curve = 1e-30;

}  // namespace amontons::direct
