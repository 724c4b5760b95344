// Every tuned number of the step, with its unit, its reason, and the test or benchmark that protects it.
// tools/check_policy.py finds numbers elsewhere.
#pragma once
#include <cstddef>

namespace amontons::step {

// Budget.

// Time left (relative): set aside by the first solve for the look ahead and the second solve
// (benchmarks/deadlines.py).
inline constexpr double share_of_look = 0.3;
// Time left (relative): set aside by impacts for the solve of the step (benchmarks/deadlines.py).
inline constexpr double share_after_impacts = 0.5;
// Reserved time (factor per step): decay of the time reserved for work after the solve.
inline constexpr double reserved_decay = 0.8;
// Time left (relative): most of it that the position solves of a step take.
inline constexpr double share_of_positions = 0.4;
// Budget left (searches for contacts): with less a first-order method runs at once, as a method takes about
// as long as a search to set up; row `hurry` of the ablation.
inline constexpr double hurried = 6;
// Iterations (count): made out of budget all the same, as bodies that nothing holds sink into each other and
// the next steps have more to do.
inline constexpr std::size_t few_iterations = 10;
// Work (products with a block): of a step of few blocks, 30 ms (test_step_limits).
inline constexpr double least_work = 1.5e6;
// Work (products with a block per pair of blocks): iterations of first-order methods grow with the size.
inline constexpr double work_per_pair = 100;
// Size (blocks): beyond it the iterations of first-order methods no longer grow.
inline constexpr double large_step = 400;
// Work left (relative): most of it that one solve takes after one of the same step has missed; half
// otherwise. Random scenes miss 25 more steps without it.
inline constexpr double work_after_miss = 0.1;

// Solve.

// Residual (tolerances): a start below it is that of a scene near rest.
inline constexpr double near_rest = 100;
// Residual (relative to that of no impulses): the same where the tolerance is loose.
inline constexpr double three_digits = 1e-3;
// Residual (tolerances): a start above it is solved again by the direct way, to rounding, in microseconds;
// four tests of creep need it.
inline constexpr double direct_start = 1e-2;
// Looks ahead (count): each followed by a solve if it finds something. With one the grains of a hopper
// overlap by 9 mm, not by 2 um (test_bands), and 1000 spheres take 0.7 of the time.
inline constexpr int most_looks = 4;
// Velocity (relative to g h): turns of contacts below it are none.
inline constexpr double least_turn = 1e-2;

// Closed contacts.

// Speed (relative to g h): overlaps close at most this fast, too slow to be seen. Nine tests of heights and
// seams need it.
inline constexpr double closing = 1e-3;
// Position error (relative to Model::length): smaller ones are not corrected, as bodies that rest shall not
// be moved.
inline constexpr double allowed_error = 1e-4;
// Slack of gaps (steps of drift at the tolerance): gaps that differ by less are alike in large problems. A
// wall at rest is 18 times slower without it.
inline constexpr double steps_of_slack = 40;
// Slack of gaps (relative to Model::length): at most, with a loose tolerance.
inline constexpr double most_slack = 1e-5;
// Size (rows): smaller problems are solved to rounding and need no slack.
inline constexpr std::size_t few_rows = 1000;

// Positions.

// Compliance (relative to D M^-1 D' times Model::lightness): of inequalities, so that joints win where they
// forbid what contacts ask for.
inline constexpr double softness = 1e-3;
// Tolerance (relative): of linear systems, which are solved to rounding in one factorisation.
inline constexpr double precision = 1e-9;
// Tolerance (relative): of systems with inequalities, as a correction is followed by others.
inline constexpr double rough_precision = 1e-4;
// Turn (rad): of a body by one correction. A body that turns by t about its joint leaves it by t^2 / 2 of its
// arm.
inline constexpr double largest_turn = 0.03;
// Size (rows): larger systems are solved by a first-order method, stopped early.
inline constexpr std::size_t few_position_rows = 300;
// Iterations (count): at which that method is stopped.
inline constexpr std::size_t most_position_iterations = 100;
// Residual (relative to that of no correction): a correction that ran out of time with more left waits for
// the next step.
inline constexpr double most_left = 0.1;
// Work of a unit wrench (relative): below it no degree of freedom lets a body move along a normal.
inline constexpr double no_motion = 1e-9;

// Safe step.

// Sweeps (count): over the fixed contacts of a body in a corner, and rounds with spins slowed in between.
inline constexpr int sweeps = 20;
// Overlap (allowed errors): bodies of joints, which would come apart, are stopped only where they are so
// deep.
inline constexpr double deep_joint = 100;
// Displacement (allowed errors): the same for what would leave within the step.
inline constexpr double far_joint = 1e4;

// Energy and second order.

// Energy gained (relative to the kinetic energy): what the residual of the solve and the O(h^2) error of the
// step may add.
inline constexpr double energy_of_motion = 1e-3;
// Energy gained (relative to that which gravity gives to free bodies in a step): the same where nothing
// moves.
inline constexpr double energy_of_gravity = 0.1;
// Parts (count): of a step that made energy from nothing, for bodies that turn by radians in a step
// (test_step_limits).
inline constexpr unsigned parts_for_energy = 4;
// Reflections (count): of one step; a row of balls passes a blow on, one reflection per ball (test_scenes).
inline constexpr int most_reflections = 64;
// Slip (relative to that of the velocities): taken out completely above it. A smooth motion that changes by a
// tenth per step has a twentieth.
inline constexpr double rough_slip = 0.6;
// Sag of locked rows (relative): of the last step, taken back; the rest keeps redundant rows determinate.
inline constexpr double remembered_sag = 0.9;
// Speed (times the fastest point of contact): faster turns belong to impulses that mean nothing any more
// (test_turns).
inline constexpr double fastest_turn = 100;

// Light bodies.

// Velocity error (relative to the velocity of a block): what counts as wrong; four random scenes break
// without it.
inline constexpr double wrong = 0.05;
// Velocity error (relative to the velocity of a block): what a wrong block is asked for then.
inline constexpr double right = 0.005;
// Speed (relative to the fastest body): counts as the velocity of a light body that has none of its own.
inline constexpr double slow = 1e-3;
// Natural map (relative to that of no impulses): rounding.
inline constexpr double least_tolerance = 1e-14;
// Velocity error (relative to the fastest body): rounding.
inline constexpr double speed_rounding = 1e-13;

}  // namespace amontons::step
