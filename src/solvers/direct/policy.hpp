// Every tuned number of the direct way, with its unit, its reason, and the test or benchmark that protects
// it. tools/check_policy.py finds numbers elsewhere.
#pragma once
#include <cstddef>

#include "amontons/base/patience.hpp"

namespace amontons::direct {

// Where the direct way applies.

// Size (rows of an island): its dense matrix takes 1 ms to factor, a first-order method about as long. With
// 300 stacks of plates were 3 times slower, 15 at worst.
inline constexpr std::size_t most_rows = 180;
// Size (rows of an island): in a problem with more bilateral rows than others, which take first-order methods
// long: robots.
inline constexpr std::size_t most_rows_on_joints = 300;
// Work (multiplications): of a factorisation of K, 10 ms. Trees need 2000 for each body, loops that cross may
// fill it up.
inline constexpr double most_factor_work = 2e7;

// Accuracy.

// Compliance (relative to the diagonal of A): least of a bilateral row in K. Redundant rows then have a pivot
// far above the rounding of what cancels there.
inline constexpr double least_compliance = 1e-13;
// Natural map (tolerances): where islands stop. Newton's steps cost microseconds, and a scene that rests
// starts its next step with the answer (test_rest).
inline constexpr double aim = 1e-5;
// Natural map (tolerances): what islands are asked for; the rest is left to the rounding of W.
inline constexpr double island_share = 0.9;
// Natural map (tolerances): what a first-order method on the constrained bodies is asked for; the rest is
// left to the rounding of K.
inline constexpr double constrained_share = 0.999;
// Natural map (relative to that of no impulses): rounding that bilateral rows may leave.
inline constexpr double bilateral_rounding = 1e-13;
// Refinements (count): of bilateral impulses; the least compliance of K slows convergence down where links
// are 1e-8 of what they carry (test_light_bodies).
inline constexpr int refinements = 6;
// Rounds (count): of solving islands for what the last one left on the true problem; masses of 1e8 : 1e-8
// need three.
inline constexpr int most_rounds = 3;
// Mobility (relative to the largest): floor of the diagonal of W for blocks that nothing moves.
inline constexpr double least_diagonal = 1e-14;

// Search for faces.

// Residual (relative to that of no impulses): a start above it is further off than nothing.
inline constexpr double far_off = 10;
// Newton steps (count): at the faces of the start, most of which are right; twice as many in the careful
// search, whose proximal term takes longer to fall.
inline constexpr std::size_t steps_at_once = 10;
// Newton steps (count): of these that may bring no better x.
inline constexpr std::size_t stale_at_once = 4;
// Proximal term (relative to the diagonal of W): makes a regular matrix where contacts outnumber the freedoms
// of the bodies, and changes their distribution by no more than the tolerance.
inline constexpr double proximal_at_once = 1e-7;
// Proximal term (relative to the diagonal of W): of the careful search; redundant contacts that oppose slips
// of 1e-7 m/s stay where they are (test_scenes, jammed dominoes).
inline constexpr double proximal_careful = 1e-3;
// Proximal term (factor): after a step without a better x, and its inverse after a slow one.
inline constexpr double proximal_rise = 10;
// Natural map (factor per step): a step that gains less is slow, as the proximal term holds it back.
inline constexpr double slow_step = 0.1;
// Proximal term (relative to the diagonal of W): rounding of W.
inline constexpr double smallest_proximal = 1e-13;
// Gradient steps (count): before faces are looked for once more, a tenth of the cost of the curve
// (test_scenes, jammed dominoes).
inline constexpr std::size_t descent = 100;
// Bound of the curvature (factor per gradient step): it may fall again.
inline constexpr double forget_curvature = 0.95;

// Work.

// Work (multiplications): of an island beside the curve, and twice the cube of its rows; 5 ms.
inline constexpr std::size_t most_island_work = 1'000'000;
// Work (multiplications): a projection or natural map of a row takes as long.
inline constexpr std::size_t multiplications_per_row = 30;
// Work (multiplications): between two looks at the budget, 10 us.
inline constexpr std::size_t unwatched_work = 5'000;
// Steps (count): along a curve that bends little.
inline constexpr std::size_t usual_curve_steps = 15;
// Steps (count): after which a curve is given up.
inline constexpr std::size_t most_curve_steps = 150;
// Work left (relative): a curve that would take more is not begun.
inline constexpr double share_of_curve = 0.4;
// Parameter t (relative): the curve has ended, below the rounding of any residual.
inline constexpr double end_of_curve = 1e-30;

}  // namespace amontons::direct
