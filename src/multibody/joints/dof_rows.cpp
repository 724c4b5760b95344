#include "multibody/joints/dof_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "multibody/bodies/gyroscopic.hpp"
#include "multibody/bodies/row_products.hpp"
#include "multibody/joints/row_terms.hpp"

// A degree of freedom q has the row D = s times its dual wrench: D v = s q', with s = length for an angle and
// 1 for a displacement. An impulse x along the row is s x along q.
namespace amontons {
namespace {

// A body at the start of the last step, and the velocity of the solve that brought it here.
struct Past {
  Transform pose;
  Vec3 centre;
  BodyVelocity velocity;
};

Past past(const BodyFrame& body, const BodyVelocity& v, double h) {
  // The solve of a step knows the mean of the gyroscopic rotation; backwards in time it is this one.
  const Vec3 spin = -torque_free_mean(body.inertia, -v.angular, h);
  const Quat turn = exponential(-h * spin);
  const Vec3 centre = body.centre - h * v.linear;
  return {{centre + rotate(turn, body.pose.position - body.centre), turn * body.pose.rotation},
          centre,
          {v.linear, spin}};
}

// The rates of a joint's coordinates q that the last step ended with, for the inertia of drives: those of the
// start velocities on the Jacobian of that step. On the present one they differ by h J' v, which over many
// steps is not small (q'' = J v' + J' v) where the axes of one joint turn with its other degrees of freedom.
std::array<double, 6> rates_before(const JointContext& now, const std::vector<BodyFrame>& bodies,
                                   const std::vector<BodyVelocity>& start, std::span<const double> q,
                                   double h) {
  const auto past_of = [&](Index body) { return body < 0 ? Past{} : past(bodies[body], start[body], h); };
  const Past a = past_of(now.joint->body_a), b = past_of(now.joint->body_b);
  // Coordinates to first order, which is enough for a Jacobian.
  std::array<double, 6> before{};
  for (std::size_t i = 0; i < now.chain.dofs; ++i)
    before[i] = q[i] - h * row_velocity(joint_row(now, now.duals[i]), start);
  JointContext then = now;
  JointPose pose{a.pose * now.joint->frame_a, b.pose * now.joint->frame_b, {}};
  pose.relative = inverse(pose.b) * pose.a;
  place(then, pose, a.centre, b.centre, std::span(before).first(now.chain.dofs));
  std::array<double, 6> rates{};
  for (std::size_t i = 0; i < now.chain.dofs; ++i) {
    const JacobianRow row = joint_row(then, then.duals[i]);
    if (row.body_a >= 0) rates[i] += power(row.a, a.velocity);
    if (row.body_b >= 0) rates[i] += power(row.b, b.velocity);
  }
  return rates;
}

struct DofRow {
  const Dof* dof;
  Index index;   // global
  double scale;  // of the row: length of an angle
  double q, target;
  DofImpulse last;
  JacobianRow row;  // scale * rate of the coordinate
  double before;    // scale * rate that the last step ended with
};

// What all rows of one joint read.
struct Maker {
  const JointContext& joint;
  const StepBodies& bodies;
  const JointOptions& options;
};

RowTag tag_of(const JointContext& joint, const DofRow& d, RowKind kind, double sign = 1) {
  return {kind, joint.index, d.index, sign, {}, {}, d.scale};
}

// The row of an implicit spring k, damper d and inertia a along q follows from its impulse
//   x = -h k (q + h q'+ - rest) - h d q'+ - a (q'+ - q'-):
//   q'+ + E x + c = 0,  E = 1 / (h^2 k + h d + a),  c = E (h k (q - rest) - a q'-)
// (Catto, "Soft constraints", GDC 2011, with the inertia of the drive added). k, d and a of an angle are
// divided by s^2, as D v is s q' and x is the impulse over s.
void append_drive(const Maker& m, const DofRow& d, JointRows& rows) {
  const double h = m.options.h, s = d.scale;
  const double k = d.dof->stiffness / (s * s), a = d.dof->armature / (s * s);
  const double stiff = h * h * k + h * d.dof->damping / (s * s) + a;
  if (stiff == 0) return;
  const double c = (h * k * s * (d.q - d.dof->rest) - a * d.before) / stiff;
  rows.cones.append(Free{});
  rows.append(d.row, 1 / stiff, c, d.last.drive / s, tag_of(m.joint, d, RowKind::drive));
}

// The speed of a position motor at the distance `way` of its target: the way within the step, but no faster
// than half of its largest acceleration a can brake, way = v h + v^2 / a. (The other half is for loads.) A
// motor that asked for way / h alone would overshoot by as much as it came from, for ever.
double approach_speed(double way, double a, double h) {
  return 2 * way / h / (1 + std::sqrt(1 + 4 * std::abs(way) / (a * h * h)));
}

// Two rigid demands that contradict each other have no solution: of motor and limit, the limit wins.
double within_limits(const DofRow& d, double c, const JointOptions& options) {
  const double up = closing(d.scale * (d.dof->upper - d.q), options);
  const double down = closing(d.scale * (d.q - d.dof->lower), options);
  return std::clamp(c, -up, down);
}

struct MotorTerms {
  double compliance, c;
};

// With a gain the motor is a damper about its speed, x = h g (target - q'+), or a spring about its target
// with a damper, x = -h g (q + h q'+ - target) - h d q'+, as in append_drive. Without, it asks for a speed:
// its own, or the one that brings it to its target.
MotorTerms motor_terms(const Maker& m, const DofRow& d) {
  const Motor& motor = d.dof->motor;
  const double h = m.options.h, s = d.scale;
  if (motor.kind == MotorKind::speed) return {motor.gain > 0 ? s * s / (h * motor.gain) : 0.0, -s * d.target};
  if (motor.gain > 0) {
    const double compliance = s * s / (h * h * motor.gain + h * motor.damping_gain);
    return {compliance, compliance * h * motor.gain * (d.q - d.target) / s};
  }
  const double quarter_turn = 0.5 * std::numbers::pi;
  const double largest = (d.dof->kind == Dof::Kind::hinge ? quarter_turn : 1) * m.options.length;
  const double strongest = motor.max_effort / s * inverse_effective_mass(d.row, m.bodies.mobility);
  return {0, std::clamp(approach_speed(s * (d.q - d.target), strongest, h), -largest / h, largest / h)};
}

// Returns the speed of the row that the motor asks for. An effort motor has no row: its impulse is known and
// part of the free velocities (add_motor_loads).
double append_motor(const Maker& m, const DofRow& d, JointRows& rows) {
  const Motor& motor = d.dof->motor;
  const double h = m.options.h, s = d.scale;
  if (motor.kind == MotorKind::none) return 0;
  if (motor.kind == MotorKind::effort) {
    rows.efforts.push_back({d.index, h * std::clamp(d.target, -motor.max_effort, motor.max_effort)});
    return 0;
  }
  auto [compliance, c] = motor_terms(m, d);
  if (motor.gain == 0 && motor.max_effort == infinity) c = within_limits(d, c, m.options);
  const double bound = h * motor.max_effort / s;
  add_interval(rows, bound);
  rows.append(d.row, compliance, c, std::clamp(d.last.motor / s, -bound, bound),
              tag_of(m.joint, d, RowKind::motor));
  return std::abs(c);
}

// Dry friction of a given size: the rate is zero as long as |x| < h friction, else x stands at the bound
// against it, which is what the variational inequality over that interval says with c = 0.
void append_friction(const Maker& m, const DofRow& d, JointRows& rows) {
  if (d.dof->friction == 0) return;
  const double bound = m.options.h * d.dof->friction / d.scale;
  add_interval(rows, bound);
  rows.append(d.row, 0, 0, std::clamp(d.last.friction / d.scale, -bound, bound),
              tag_of(m.joint, d, RowKind::friction));
}

// q - lower >= 0 and upper - q >= 0; limits that meet lock the dof.
void append_limits(const Maker& m, const DofRow& d, double motor_speed, JointRows& rows) {
  const double s = d.scale, last = d.last.limit / s;
  if (d.dof->lower == d.dof->upper) {
    rows.cones.append(Free{});
    rows.append(d.row, regularisation(d.row, m.bodies), recovery(s * (d.q - d.dof->lower), m.options), last,
                tag_of(m.joint, d, RowKind::limit));
    return;
  }
  for (const double sign : {1.0, -1.0}) {
    const double gap = s * (sign > 0 ? d.q - d.dof->lower : d.dof->upper - d.q);
    if (!(gap < infinity) || !within_reach(d.row, m.bodies, gap, motor_speed, m.options)) continue;
    rows.cones.append(NonNegative{});
    rows.append(sign * d.row, 0, closing(gap, m.options), std::max(sign * last, 0.0),
                tag_of(m.joint, d, RowKind::limit, sign));
  }
}

bool has_rows(const Dof& dof) {
  return dof.stiffness > 0 || dof.damping > 0 || dof.armature > 0 || dof.friction > 0 ||
         dof.motor.kind != MotorKind::none || dof.lower > -infinity || dof.upper < infinity;
}

}  // namespace

void append_dof_rows(const Model& model, const JointContext& joint, const StepBodies& bodies,
                     const State& state, const JointOptions& options, JointRows& rows) {
  const std::size_t first = model.first_dof(joint.index);
  const auto& dofs = joint.joint->dofs;
  const std::span<const double> q = std::span(state.coordinates).subspan(first);
  std::array<double, 6> rates{};
  if (std::any_of(dofs.begin(), dofs.end(), [](const Dof& dof) { return dof.armature > 0; }))
    rates = rates_before(joint, bodies.frames, bodies.start, q, options.h);
  const Maker m{joint, bodies, options};
  for (std::size_t i = 0; i < joint.chain.dofs; ++i) {
    const Dof& dof = dofs[i];
    if (!has_rows(dof)) continue;
    const double s = joint.scale(i);
    const DofRow d{&dof,
                   static_cast<Index>(first + i),
                   s,
                   q[i],
                   dof.motor.kind == MotorKind::none ? 0 : state.targets[first + i],
                   state.dof_impulses[first + i],
                   joint_row(joint, s * joint.duals[i]),
                   dof.armature > 0 ? s * rates[i] : 0};
    append_drive(m, d, rows);
    const double motor_speed = append_motor(m, d, rows);
    append_friction(m, d, rows);
    append_limits(m, d, motor_speed, rows);
  }
}

}  // namespace amontons
