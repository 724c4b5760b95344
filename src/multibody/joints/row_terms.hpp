#pragma once
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"

// What the rows of joints have in common. A row asks
//   u = D v+ + E x + c,  -u in the normal cone of x's set
// with x the impulse along D'. From a constraint C(q) with the Jacobian D = dC/dq:
// - a rigid equality C = 0 at the end of the step is, to first order in h, C + h D v+ = 0: E = 0, c = C / h,
// x
//   free (Baumgarte's stabilisation with the factor 1, and a bound on c);
// - a spring of compliance e and no mass, C + h D v+ = -e x / h: E = e / h^2, c = C / h, x free;
// - an inequality C >= 0 is C + h D v+ >= 0: c = C / h, x >= 0, complementary;
// - a bounded effort |x| <= h effort against D v+ + c: x in that interval. Dry friction has c = 0, a motor c
// =
//   -speed.
namespace amontons {

// Locked rows that repeat each other (the two hinges of a door, planar loops) make A singular, and nothing
// then decides how they share the load. This compliance, relative to D M^-1 D' of the row, makes them share
// it evenly. Not larger: a row sags by this fraction of g h^2 (times the mass that it carries over its own),
// 2e-11 m for a body on one joint. Not smaller: positions are known to 1e-16 of their size, and that
// rounding, over h and over this compliance, is a load that redundant rows put on each other, below 1e-4 of
// the weight.
constexpr double locked_regularisation = 1e-7;
double regularisation(const JacobianRow& row, const StepBodies& bodies);

// c of an equality: the error is taken back within the step, but no faster than the recovery speed.
double recovery(double error, const JointOptions& options);
// c of an inequality: a gap may close within the step; a negative one is taken back as an error.
double closing(double gap, const JointOptions& options);

// Whether a limit at distance `gap` may matter in this step: what collisions and other joints may do to the
// velocity is covered by the tenth of a length (or rad). A limit that was missed is caught in the next step.
bool within_reach(const JacobianRow& row, const StepBodies& bodies, double gap, double motor_speed,
                  const JointOptions& options);

// The set [-bound, bound] for the row to come.
void add_interval(JointRows& rows, double bound);

}  // namespace amontons
