// Every tuned number of the step. A number enters with its unit, its reason, and the test or benchmark that
// protects it; tools/check_policy.py finds numbers elsewhere.
#pragma once
#include <cstddef>

namespace amontons::step {

// Budget.

// Time left (relative): set aside by the first solve for the look ahead and the second solve.
inline constexpr double share_of_look = 0.3;
// Time left (relative): set aside by impacts for the solve of the step.
inline constexpr double share_after_impacts = 0.5;
// Reserved time (factor per step): decay of the time reserved for work after the solve.
inline constexpr double reserved_decay = 0.8;
// Time left (relative): most of it that the position solves of a step take.
inline constexpr double share_of_positions = 0.4;
// Searches for contacts (count): with less of the budget left a first-order method runs at once, as a method
// takes about as long as a search to set up.
inline constexpr double hurried = 6;
// Iterations (count) out of budget: bodies that nothing holds sink into each other, and the next steps have
// more to do.
inline constexpr std::size_t few_iterations = 10;
// Work (blocks of products with A) of a step: least, and per pair of blocks up to `large_step` blocks, after
// which the iterations of first-order methods no longer grow.
inline constexpr double least_work = 1.5e6, work_per_pair = 100, large_step = 400;
// Work left (relative): most of it that one solve takes, and after a solve of the same step has missed.
inline constexpr double work_of_solve = 0.5, work_after_miss = 0.1;

// Solve.

// Residual (relative to that of no impulses) of a start, up to which it is used: impulses of the last step
// carry what rests, whatever something new does to the residual. Piles under iteration limits sank less with
// 2, 3 and 10.
inline constexpr double worst_start = 3;
// Residual of a start (tolerances; absolute): below both the scene is near rest.
inline constexpr double near_rest = 100, three_digits = 1e-3;
// Aim near rest (tolerances): half, so that the next starts are within the tolerance. A tenth cost four times
// as much.
inline constexpr double aim_at_rest = 0.5;
// Residual (tolerances) of a start above which the direct way solves again, to rounding, in microseconds.
inline constexpr double direct_start = 1e-2;
// Velocity of a turn of a contact (relative to g h): smaller turns are none.
inline constexpr double least_turn = 1e-2;

// Contacts that are closed.

// Speed (relative to g h): overlaps of closed contacts close at most this fast, too slow to be seen.
inline constexpr double closing = 1e-3;
// Position error (relative to Model::length()): smaller ones are not corrected.
inline constexpr double allowed_error = 1e-4;
// Allowed errors (count): deeper rigid overlaps are left to the correction of positions. A pinched body would
// make the problem infeasible.
inline constexpr double deep = 2;
// Slack of gaps in large problems: tolerance-steps of drift (count), at most this fraction of
// Model::length().
inline constexpr double steps_of_slack = 40, most_slack = 1e-5;
// Rows (count) of a problem that is solved to rounding and needs no slack.
inline constexpr std::size_t few_rows = 1000;
// Positions.

// Compliance (relative to D M^-1 D' times Model::lightness()) of inequalities: where joints forbid what
// contacts ask for, joints win.
inline constexpr double softness = 1e-3;
// Tolerance of linear systems, which are solved to rounding, and of systems with inequalities.
inline constexpr double precision = 1e-9, rough_precision = 1e-4;
// Turn (rad) of a body by one correction: a body that turns by t about its joint leaves it by t^2 / 2 of its
// arm.
inline constexpr double largest_turn = 0.03;
// Rows (count): more are solved by a first-order method, stopped after so many iterations.
inline constexpr std::size_t few_position_rows = 300, most_position_iterations = 100;
// Residual of a correction that ran out of time: with more left it waits for the next step.
inline constexpr double most_left = 0.1;
// Work of a unit wrench (relative): below it no dof lets a body move along a normal.
inline constexpr double no_motion = 1e-9;

// Safe step.

// Sweeps (count) over the fixed contacts, and rounds with spins slowed in between.
inline constexpr int sweeps = 20, spin_rounds = 20;
// Allowed errors (count): bodies of joints, which would come apart, are stopped only that deep or that far
// off.
inline constexpr double deep_joint = 100, far_joint = 1e4;
// Turn (rad) within a step: most that an unsolved body spins by.
inline constexpr double most_spin = 0.5;

// Energy.

// Energy that a step may gain, relative to the kinetic energy and to the energy that gravity gives to free
// bodies in one step. It covers the residual of the solve and the O(h^2) error of the step.
inline constexpr double energy_of_motion = 1e-3, energy_of_gravity = 0.1;

// Parts (count) of a step that made energy from nothing, at most: bodies that turn by radians in a step
// (tests/python/test_step_limits.py).
inline constexpr unsigned parts_for_energy = 4;

// Impacts.

// Reflections (count) of one step: a row of balls passes a blow on, one reflection per ball.
inline constexpr int most_reflections = 64;

// Second order.

// Slip of the last step (relative to that of the velocities) that is taken out completely: a smooth motion
// that changes by a tenth per step has a twentieth.
inline constexpr double rough_slip = 0.6;
// Sag of locked rows (relative) of the last step that is taken back; the rest keeps redundant rows
// determinate.
inline constexpr double remembered_sag = 0.9;
// Turn (rad) of a normal in half a step: more is a body that passes by.
inline constexpr double most_normal_turn = 0.5;
// Speed (times the fastest point of contact): faster turns belong to impulses that mean nothing any more.
inline constexpr double fastest_turn = 100;

// Light bodies.

// Velocity error of a block (relative to its velocity): what counts as wrong, and what it is asked for then.
inline constexpr double wrong = 0.05, right = 0.005;
// Speed (relative to the fastest body) that counts as the velocity of a light body.
inline constexpr double slow = 1e-3;
// Natural map (relative to that of no impulses) and speeds (relative): rounding.
inline constexpr double least_tolerance = 1e-14, speed_rounding = 1e-13;

}  // namespace amontons::step
