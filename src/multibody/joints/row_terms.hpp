#pragma once
#include <optional>
#include <span>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"
#include "multibody/joints/joint_context.hpp"

// The common form of joint rows. A row requires, docs/algorithm.md (5),
//   u = D v+ + E x + c,  -u in the normal cone of x's set
// with x the impulse along D' over the kick k. For a constraint C(q) with the Jacobian D = dC/dq:
// - a rigid equality C = 0 at the end of the step is, to first order in h, C + h D v+ = 0: E = 0, c = C / h
//   and x free (Baumgarte's stabilisation with the factor 1, and a bound on c);
// - a spring of compliance e without mass, C + h D v+ = -e x / k: E = e / (h k), c = C / h, x free;
// - an inequality C >= 0 is C + h D v+ >= 0: c = C / h, x >= 0, complementary;
// - a bounded effort |x| <= k effort against D v+ + c: x in that interval. Dry friction has c = 0, a motor
//   c = -speed.
// Each of these is one function below. A caller provides D and C, and the place of the impulse.
namespace amontons {

// Input of every function that makes rows.
struct RowInput {
  const Model& model;
  const StepBodies& bodies;
  std::span<const JointContext> joints;
  const State& state;
  const JointOptions& options;
};
// The controls that efforts follow.
inline std::span<const double> effort_controls(const RowInput& in) {
  return in.options.controls.empty() ? std::span<const double>(in.state.controls) : in.options.controls;
}

// E and c of the equality C = error with the compliance e (0: rigid). `inverse_mass` is D M^-1 D' times
// Model::lightness() of the bodies.
RowTerms equality_terms(double error, double e, double inverse_mass, const JointOptions& options);
// c of a rigid inequality: a gap may close within the step; a negative gap is corrected as an error.
double closing(double gap, const JointOptions& options);

// Where a row acts, its impulse in the last step, which becomes the warm start after the projection on the
// set of the row, and the place of its impulse.
struct RowPlace {
  const JacobianRow& row;
  double last;
  const RowTag& tag;
};
// The rows themselves.
void append_equality(const RowInput& in, const RowPlace& at, double error, double e, JointRows& rows);
// Appends nothing if the gap cannot close within the step. motor_speed: speed that a motor along the row
// demands.
void append_inequality(const RowInput& in, const RowPlace& at, double gap, double e, double motor_speed,
                       JointRows& rows);
// bound: limit of |x|, N s; infinite for an unlimited effort.
void append_bounded(double bound, const RowPlace& at, const RowTerms& terms, JointRows& rows);
// The same with asymmetric bounds of x.
void append_bounded(double lower, double upper, const RowPlace& at, const RowTerms& terms, JointRows& rows);

// Forces along a coordinate by a law: spring, damper and inertia, and a constant effort.
struct Drive {
  double stiffness = 0, stretch = 0;  // of the spring
  double damping = 0;
  double inertia = 0, rate = 0;  // rate after the last step, on the Jacobian of its start
  double effort = 0;
  double speed = 0;  // the same rate on the present Jacobian
};
// E and c of a drive in the row of a coordinate q, D v = s q', with the inverse mass of the row. Empty
// without spring, damper and inertia, because the impulse is then known. Displacements that correct positions
// take the spring at their end.
std::optional<RowTerms> drive_terms(const Drive& drive, double s, double inverse_mass,
                                    const JointOptions& options);

// The spring of a drive sees the stretch at the start plus stretch_after q'+ + stretch_before q'-, its damper
// the rate rate_after q'+ + rate_before q'-. With euler = 0 this is the implicit midpoint rule, which keeps
// the energy of a spring and has the second order. With euler = 1 it is implicit Euler, which damps what the
// step does not resolve.
struct DriveShares {
  double stretch_after, stretch_before, rate_after, rate_before;
};
DriveShares drive_shares(double h, double last, double euler);
// The share of implicit Euler for a spring and a damper on an inverse mass. It is 0 as long as the step h
// resolves them (h w < 1) and 1 beyond h w = 2, without a jump between. The inverse mass is that of the two
// bodies alone, which is too large rather than too small: what it makes stiff is damped.
double euler_share(double stiffness, double damping, double inverse_mass, double h);

// Whether an inequality at distance `gap` may act in this step, at the fastest known speed along it.
bool within_reach(double gap, double speed, const JointOptions& options);

// Products of one Jacobian row j, a wrench on each of its bodies, with the bodies' velocities and inverse
// masses.

// One side of the row: the power of its wrench, <j, v>.
inline double power(const std::array<double, 6>& j, const BodyVelocity& v) {
  return j[0] * v.linear.x + j[1] * v.linear.y + j[2] * v.linear.z + j[3] * v.angular.x + j[4] * v.angular.y +
         j[5] * v.angular.z;
}

// The velocity along the row, u + j v. u comes first, because c is in D v + c. Bodies without an entry, the
// world and auxiliary ones, are at rest.
inline double row_velocity(const JacobianRow& row, const BodyVelocities& v, double u = 0) {
  const Index n = static_cast<Index>(v.size());
  if (row.body_a >= 0 && row.body_a < n) u += power(row.a, v[row.body_a]);
  if (row.body_b >= 0 && row.body_b < n) u += power(row.b, v[row.body_b]);
  return u;
}

// One side of j M^-1 j': f'f / m + t' I^-1 t.
inline double side_inverse_mass(const std::array<double, 6>& j, const BodyMobility& body) {
  const Vec3 f{j[0], j[1], j[2]}, t{j[3], j[4], j[5]};
  return body.inverse_mass * dot(f, f) + dot(t, body.inverse_inertia * t);
}

// The inverse of the row's effective mass, j M^-1 j': the velocity along the row per unit impulse along it.
// Auxiliary bodies do not count.
inline double inverse_effective_mass(const JacobianRow& row, const BodyMobilities& bodies) {
  const Index n = static_cast<Index>(bodies.size());
  double w = 0;
  if (row.body_a >= 0 && row.body_a < n) w += side_inverse_mass(row.a, bodies[row.body_a]);
  if (row.body_b >= 0 && row.body_b < n) w += side_inverse_mass(row.b, bodies[row.body_b]);
  return w;
}

// The same with the mobility that bodies of trees have.
double inverse_effective_mass(const JacobianRow& row, const StepBodies& bodies);

}  // namespace amontons
