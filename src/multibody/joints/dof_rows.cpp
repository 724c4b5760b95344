#include "multibody/joints/dof_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "multibody/bodies/motion.hpp"
#include "multibody/joints/actuator_rows.hpp"
#include "multibody/model/stribeck.hpp"

// A degree of freedom q has the row D = s times its dual wrench: D v = s q', with s = length for an angle and
// 1 for a displacement. An impulse x along the row is s x along q.
namespace amontons {
// The last step is reversed from the state: poses moved with constant velocities, the angular one being the
// mean of the gyroscopic rotation. The way back is that of the kick. Rates of the poses there lag behind
// those of the middle of the last step. Rates of the present poses lag as much behind those of this step.
const std::vector<Past>& past_of(const RowInput& in, JointRows& rows) {
  const double kick = in.options.kick, last = in.options.last();
  for (std::size_t i = rows.past.size(); i < in.bodies.frames.size(); ++i) {
    const BodyFrame& body = in.bodies.frames[i];
    const BodyVelocity& v = in.bodies.start[i];
    // The solve of a step uses the mean of the gyroscopic rotation; this is the mean backwards in time.
    const BodyVelocity velocity{v.linear, -torque_free_mean(body.inertia, -v.angular, last)};
    rows.past.push_back({moved(body, velocity, -kick), body.centre - kick * v.linear, velocity});
  }
  return rows.past;
}

// The rates are those of the start velocities on the Jacobian of the last step. On the present Jacobian they
// would differ by h J' v. Over many steps that is not small (q'' = J v' + J' v) if the axes of a joint turn
// with its other degrees of freedom.
std::array<double, 6> rates_before(const RowInput& in, const JointContext& now, std::span<const double> q,
                                   JointRows& rows) {
  const std::vector<Past>& past = past_of(in, rows);
  const Past still;
  const auto past_body = [&](Index body) -> const Past& { return body < 0 ? still : past[body]; };
  const Past &a = past_body(now.joint->body_a), &b = past_body(now.joint->body_b);
  std::array<double, 6> before{}, rates{};
  if (is_hinge(*now.joint)) {
    const Vec3 axis = rotate(b.pose.rotation * now.joint->frame_b.rotation, now.duals[0].angular);
    rates[0] = dot(axis, (now.body_a < 0 ? Vec3{} : a.velocity.angular) -
                             (now.body_b < 0 ? Vec3{} : b.velocity.angular));
    return rates;
  }
  // Coordinates to first order, which suffices for a Jacobian.
  const Screw twist = joint_twist(now, in.bodies.start);
  for (std::size_t i = 0; i < now.chain.dofs; ++i)
    before[i] = q[i] - in.options.kick * dot(now.duals[i], twist);
  JointContext then = now;
  place(then, joint_pose(*now.joint, a.pose, b.pose), a.centre, b.centre,
        std::span(before).first(now.chain.dofs));
  const Screw twist_then = joint_twist(then, a.velocity, b.velocity);
  for (std::size_t i = 0; i < now.chain.dofs; ++i) rates[i] = dot(then.duals[i], twist_then);
  return rates;
}

namespace {

// One degree of freedom, ready to make rows. The velocity of the row is that of the coordinate times s, its
// impulse that of the coordinate over s.
struct DofRow {
  const Dof& dof;
  Index joint, index;   // of the dof: global index
  double scale;         // s
  double q, control;    // m or rad; the target of the motor
  double mean_control;  // of efforts
  DofImpulse last;      // along q
  JacobianRow row;      // D v = s q'
  double before;        // q' at the end of the last step

  RowTag tag(RowKind kind, double sign = 1) const { return {kind, joint, index, sign, {}, {}, scale}; }
};

// Spring, damper and inertia of a coordinate.
std::optional<RowTerms> terms_of(const RowInput& in, const DofRow& d, Drive drive) {
  drive.speed = row_velocity(d.row, in.bodies.start) / d.scale;
  return drive_terms(drive, d.scale, inverse_effective_mass(d.row, in.bodies), in.options);
}

void append_passive(const RowInput& in, const DofRow& d, JointRows& rows) {
  const Dof& dof = d.dof;
  const double damping = in.options.dampers ? dof.damping : 0;
  if (dof.stiffness == 0 && damping == 0 && dof.armature == 0) return;
  const auto terms = terms_of(in, d, {dof.stiffness, d.q - dof.rest, damping, dof.armature, d.before});
  if (terms) rows.append(Bilateral{}, d.row, *terms, d.last.passive / d.scale, d.tag(RowKind::passive));
}

// The speed of a position motor at the distance `way` from its target. It is the travel within the step, but
// no faster than half of its largest acceleration a can brake, way = v h + v^2 / a. (The other half is for
// loads.) A motor with the speed way / h would overshoot by as much as it approached, for ever.
//
// v^2 / a + h v - |way| = 0 has the positive root v = a (-h + sqrt(h^2 + 4 |way| / a)) / 2. Multiplied by the
// conjugate it has no cancellation for short travels, and an infinite a gives v = way / h.
double approach_speed(double way, double a, double h) {
  return 2 * way / h / (1 + std::sqrt(1 + 4 * std::abs(way) / (a * h * h)));
}

// Two rigid demands that contradict each other have no solution: between motor and limit, the limit prevails.
// The motor's demand is the speed c of u = D v + c. -c must lie between the speeds that reach the limits at
// the end of the step.
double within_limits(const DofRow& d, double c, const JointOptions& options) {
  const double up = closing(d.scale * (d.dof.upper - d.q), options);
  const double down = closing(d.scale * (d.q - d.dof.lower), options);
  return std::clamp(c, -up, down);
}

// With gains the motor is a damper about its velocity, or a spring about its coordinate with a damper.
// Without gains it demands a velocity: its own, or the one that reaches its coordinate.
RowTerms motor_terms(const RowInput& in, const DofRow& d) {
  const Motor& motor = d.dof.motor;
  const double h = in.options.h, s = d.scale;
  if (motor.kind == MotorKind::velocity) {
    if (motor.kd > 0) return *terms_of(in, d, {0, 0, motor.kd, 0, 0, motor.kd * d.control});
    return {0, -s * d.control};
  }
  if (motor.kp > 0) return *terms_of(in, d, {motor.kp, d.q - d.control, motor.kd});
  // Turns can be counted if a step makes less than half of one; a quarter leaves room. A slide has no turns,
  // but a jump of the target by metres must not fling the bodies: at most a length.
  const double quarter_turn = 0.5 * std::numbers::pi;
  const double largest = (d.dof.kind == Dof::Kind::hinge ? quarter_turn : 1) * in.options.length;
  const double strongest = motor.max_effort / s * inverse_effective_mass(d.row, in.bodies);
  return {0, std::clamp(approach_speed(s * (d.q - d.control), strongest, h), -largest / h, largest / h)};
}

// Returns the speed of the row that the motor demands. An effort motor has no row: its known impulse is part
// of the free velocities (add_motor_loads).
double append_motor(const RowInput& in, const DofRow& d, JointRows& rows) {
  const Motor& motor = d.dof.motor;
  const double kick = in.options.kick;
  if (motor.kind == MotorKind::none) return 0;
  if (motor.kind == MotorKind::effort) {
    RowTag tag = d.tag(RowKind::motor);
    tag.scale = 1;
    rows.efforts.push_back({tag, kick * std::clamp(d.mean_control, -motor.max_effort, motor.max_effort)});
    return 0;
  }
  RowTerms terms = motor_terms(in, d);
  if (motor.kp == 0 && motor.kd == 0 && motor.max_effort == infinity) {
    terms.c = within_limits(d, terms.c, in.options);
    terms.restraint = Restraint::held;
  }
  append_bounded(kick * motor.max_effort / d.scale, {d.row, d.last.motor / d.scale, d.tag(RowKind::motor)},
                 terms, rows);
  return std::abs(terms.c);
}

// q - lower >= 0 and upper - q >= 0; equal limits lock the dof. Each side within reach is a row of its own:
// both may act in one step, on a dof that is nearly locked. An upper limit has the row and the impulse of the
// opposite direction.
void append_limits(const RowInput& in, const DofRow& d, double motor_speed, JointRows& rows) {
  const double s = d.scale, last = d.last.limit / s;
  const double above = s * (d.q - d.dof.lower), below = s * (d.dof.upper - d.q);
  if (d.dof.lower == d.dof.upper)
    return append_equality(in, {d.row, last, d.tag(RowKind::limit)}, above, 0, rows);
  append_inequality(in, {d.row, last, d.tag(RowKind::limit)}, above, 0, motor_speed, rows);
  append_inequality(in, {-1.0 * d.row, -last, d.tag(RowKind::limit, -1)}, below, 0, motor_speed, rows);
}

}  // namespace

void append_dof_rows(const RowInput& in, const JointContext& joint, JointRows& rows) {
  const std::size_t first = in.model.first_dof(joint.index);
  const auto& dofs = joint.joint->dofs;
  const std::span<const double> q = std::span(in.state.coordinates).subspan(first);
  std::array<double, 6> rates{};
  // The correction of positions, without dampers, does not read c of drives.
  if (in.options.dampers && !joint.in_tree &&
      std::any_of(dofs.begin(), dofs.end(), [](const Dof& dof) { return dof.armature > 0; }))
    rates = rates_before(in, joint, q, rows);
  for (std::size_t i = 0; i < dofs.size(); ++i) {
    const Dof& dof = dofs[i];
    const double s = joint.scale(i);
    const Index control = in.model.control_of_dof(first + i);
    const DofRow d{dof,
                   joint.index,
                   static_cast<Index>(first + i),
                   s,
                   q[i],
                   control < 0 ? 0 : in.state.controls[control],
                   control < 0 ? 0 : effort_controls(in)[control],
                   in.state.dof_impulses[first + i],
                   dof_row(joint, i),
                   dof.armature > 0 ? rates[i] : 0};
    if (!joint.in_tree) append_passive(in, d, rows);  // M of trees has them
    const double motor_speed = append_motor(in, d, rows);
    for (const Index k : in.model.actuators_of_dof(first + i))
      append_actuator(in, k, {d.row, s, {}, q[i], row_velocity(d.row, in.bodies.start) / s}, rows);
    // Dry friction of a given size: the rate is zero while |x| < h friction, otherwise x is at the bound
    // against it. This is the variational inequality over that interval with c = 0.
    const double slip = in.state.dof_slips.empty() ? 0 : in.state.dof_slips[first + i];
    const double friction = friction_at(dof.friction, dof.friction_static, dof.stribeck_speed, slip);
    if (friction > 0)
      append_bounded(in.options.kick * friction / s, {d.row, d.last.friction / s, d.tag(RowKind::friction)},
                     {0, 0}, rows);
    append_limits(in, d, motor_speed, rows);
  }
}

}  // namespace amontons
