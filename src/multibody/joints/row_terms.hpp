#pragma once
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"

// What the rows of joints have in common. A row asks
//   u = D v+ + E x + c,  -u in the normal cone of x's set
// with x the impulse along D'. From a constraint C(q) with the Jacobian D = dC/dq:
// - a rigid equality C = 0 at the end of the step is, to first order in h, C + h D v+ = 0: E = 0, c = C / h
//   and x free (Baumgarte's stabilisation with the factor 1, and a bound on c);
// - a spring of compliance e and no mass, C + h D v+ = -e x / h: E = e / h^2, c = C / h, x free;
// - an inequality C >= 0 is C + h D v+ >= 0: c = C / h, x >= 0, complementary;
// - a bounded effort |x| <= h effort against D v+ + c: x in that interval. Dry friction has c = 0, a motor
//   c = -speed.
// Each of these is one function below. A maker of rows brings D and C, and says where the impulse belongs.
namespace amontons {

// What every maker of rows reads.
struct RowInput {
  const Model& model;
  const StepBodies& bodies;
  const State& state;
  const JointOptions& options;
};

// Of the equality C = error with the compliance e, 0 for a rigid one. `inverse_mass` is D M^-1 D'.
RowTerms equality_terms(double error, double e, double inverse_mass, const JointOptions& options);
// c of a rigid inequality: a gap may close within the step; a negative one is taken back as an error.
double closing(double gap, const JointOptions& options);

// The rows themselves. `last` is the impulse of the last step along the row; it becomes the warm start after
// the projection on the set of the row.
void append_equality(const RowInput& in, const JacobianRow& row, double error, double e, double last,
                     const RowTag& tag, JointRows& rows);
// Nothing is appended for a gap that cannot close within the step. motor_speed: that a motor along the row
// asks for.
void append_inequality(const RowInput& in, const JacobianRow& row, double gap, double e, double motor_speed,
                       double last, const RowTag& tag, JointRows& rows);
// bound: of |x|, N s; infinite for an effort without one.
void append_bounded(double bound, const JacobianRow& row, const RowTerms& terms, double last,
                    const RowTag& tag, JointRows& rows);

}  // namespace amontons
