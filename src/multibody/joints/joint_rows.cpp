// The rows of one joint. A row of an implicit spring k, damper d and inertia a along a coordinate q follows
// from
//   x = -h k (q + h q'+ - rest) - h d q'+ - a (q'+ - q'-):
//   q'+ + E x + c = 0,  E = 1 / (h^2 k + h d + a),  c = E (h k (q - rest) - a q'-)
// (Catto, "Soft constraints", GDC 2011, with the inertia of the drive added).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "multibody/joints/joint_kinematics.hpp"

namespace amontons {
namespace {

// An error that is taken back within the step, but no faster than the recovery speed.
double recovery(double error, const JointOptions& options) {
  return std::clamp(error / options.h, -options.recovery_speed, options.recovery_speed);
}

void add_interval(JointRows& rows, double bound) {
  if (bound == infinity) {
    rows.cones.add_free(1);
    return;
  }
  const double lo = -bound;
  rows.cones.add_interval({&lo, 1}, {&bound, 1});
}

// Whether a limit at distance `gap` may matter in this step: what collisions and other joints may do to the
// velocity is covered by the tenth of a length (or rad). A limit that was missed is caught in the next step.
bool within_reach(const std::vector<BodyFrame>& bodies, const JacobianRow& row, double gap,
                  double motor_speed, const JointOptions& options) {
  const double speed =
      std::max({std::abs(start_velocity(bodies, row)), std::abs(free_velocity(bodies, row)), motor_speed});
  return gap <= 2 * options.h * speed + 0.1 * options.length;
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

RowTag tag_of(const JointContext& joint, const DofRow& d, RowKind kind, double sign = 1) {
  return {kind, joint.index, d.index, sign, {}, {}, d.scale};
}

void append_drive(const JointContext& joint, const DofRow& d, const JointOptions& options, JointRows& rows) {
  const double h = options.h, s = d.scale;
  const double k = d.dof->stiffness / (s * s), a = d.dof->armature / (s * s);
  const double stiff = h * h * k + h * d.dof->damping / (s * s) + a;
  if (stiff == 0) return;
  const double c = (h * k * s * (d.q - d.dof->rest) - a * d.before) / stiff;
  rows.cones.add_free(1);
  append_row(rows, d.row, 1 / stiff, c, d.last.drive / s, tag_of(joint, d, RowKind::drive));
}

// The speed of a position motor at the distance `way` of its target: the way within the step, but no faster
// than half of its largest acceleration a can brake, way = v h + v^2 / a. (The other half is for loads.) A
// motor that asked for way / h alone would overshoot by as much as it came from, for ever.
double approach_speed(double way, double a, double h) {
  return 2 * way / h / (1 + std::sqrt(1 + 4 * std::abs(way) / (a * h * h)));
}

// Two rigid demands that contradict each other have no solution: of motor and limit, the limit wins.
double within_limits(const DofRow& d, double c, const JointOptions& options) {
  const auto fastest = [&](double gap) { return std::max(gap / options.h, -options.recovery_speed); };
  return std::clamp(c, -fastest(d.scale * (d.dof->upper - d.q)), fastest(d.scale * (d.q - d.dof->lower)));
}

// Returns the speed of the row that the motor asks for.
double append_motor(const JointContext& joint, const DofRow& d, const std::vector<BodyFrame>& bodies,
                    const JointOptions& options, JointRows& rows) {
  const Motor& motor = d.dof->motor;
  const double h = options.h, s = d.scale;
  if (motor.kind == MotorKind::none) return 0;
  if (motor.kind == MotorKind::effort) {
    rows.efforts.push_back({d.index, h * std::clamp(d.target, -motor.max_effort, motor.max_effort)});
    return 0;
  }
  double compliance = 0, c;
  if (motor.kind == MotorKind::speed) {
    if (motor.gain > 0) compliance = s * s / (h * motor.gain);
    c = -s * d.target;
  } else if (motor.gain > 0) {
    compliance = s * s / (h * h * motor.gain + h * motor.damping_gain);
    c = compliance * h * motor.gain * (d.q - d.target) / s;
  } else {
    const double largest = (d.dof->kind == Dof::Kind::hinge ? 0.5 * std::numbers::pi : 1) * options.length;
    const double strongest = motor.max_effort / s * inverse_effective_mass(bodies, d.row);
    c = std::clamp(approach_speed(s * (d.q - d.target), strongest, h), -largest / h, largest / h);
  }
  if (motor.gain == 0 && motor.max_effort == infinity) c = within_limits(d, c, options);
  const double bound = h * motor.max_effort / s;
  add_interval(rows, bound);
  append_row(rows, d.row, compliance, c, std::clamp(d.last.motor / s, -bound, bound),
             tag_of(joint, d, RowKind::motor));
  return std::abs(c);
}

void append_friction(const JointContext& joint, const DofRow& d, const JointOptions& options,
                     JointRows& rows) {
  if (d.dof->friction == 0) return;
  const double bound = options.h * d.dof->friction / d.scale;
  add_interval(rows, bound);
  append_row(rows, d.row, 0, 0, std::clamp(d.last.friction / d.scale, -bound, bound),
             tag_of(joint, d, RowKind::friction));
}

void append_limits(const JointContext& joint, const DofRow& d, double motor_speed,
                   const std::vector<BodyFrame>& bodies, const JointOptions& options, JointRows& rows) {
  const double s = d.scale, last = d.last.limit / s;
  if (d.dof->lower == d.dof->upper) {
    rows.cones.add_free(1);
    append_row(rows, d.row, locked_regularisation * inverse_effective_mass(bodies, d.row),
               recovery(s * (d.q - d.dof->lower), options), last, tag_of(joint, d, RowKind::limit));
    return;
  }
  for (const double sign : {1.0, -1.0}) {
    const double gap = s * (sign > 0 ? d.q - d.dof->lower : d.dof->upper - d.q);
    if (!(gap < infinity) || !within_reach(bodies, d.row, gap, motor_speed, options)) continue;
    rows.cones.add_nonnegative(1);
    append_row(rows, sign * d.row, 0, std::max(gap / options.h, -options.recovery_speed),
               std::max(sign * last, 0.0), tag_of(joint, d, RowKind::limit, sign));
  }
}

bool has_rows(const Dof& dof) {
  return dof.stiffness > 0 || dof.damping > 0 || dof.armature > 0 || dof.friction > 0 ||
         dof.motor.kind != MotorKind::none || dof.lower > -infinity || dof.upper < infinity;
}

Vec3 ball_component(int axis, double value) {
  Vec3 v;
  v[axis] = value;
  return v;
}

}  // namespace

void append_row(JointRows& rows, const JacobianRow& row, double compliance, double c, double x0,
                const RowTag& tag) {
  rows.jacobian.push_back(row);
  rows.compliance.push_back(compliance);
  rows.c.push_back(c);
  rows.x0.push_back(x0);
  rows.tags.push_back(tag);
}

void append_locked_rows(const JointContext& joint, const std::vector<BodyFrame>& bodies, const State& state,
                        const JointOptions& options, JointRows& rows) {
  const double L = options.length, compliance = joint.joint->compliance;
  std::array<Screw, 6> wrenches;
  const std::size_t count = locked_wrenches(joint.chain, L, wrenches);
  const JointWrench& last = state.joint_wrenches[joint.index];
  // The stored wrench is about the origin of frame_a, the rows are about the reference.
  const Vec3 last_torque = last.torque - cross(joint.arm, last.force);
  rows.cones.add_free(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Screw& w = wrenches[i];
    const JacobianRow row = joint_row(joint, w);
    const double error = dot(w, joint.chain.error);
    const double x0 = dot(w.linear, last.force) + dot(w.angular, last_torque) / (L * L);
    const double rigid = locked_regularisation * inverse_effective_mass(bodies, row);
    RowTag tag{RowKind::locked, joint.index, -1};
    tag.force = w.linear, tag.torque = w.angular + cross(joint.arm, w.linear);
    append_row(rows, row, compliance > 0 ? compliance / (options.h * options.h) : rigid,
               compliance > 0 ? error / options.h : recovery(error, options), x0, tag);
  }
}

void append_dof_rows(const Model& model, const JointContext& joint, const std::vector<BodyFrame>& bodies,
                     const State& state, const JointOptions& options, JointRows& rows) {
  const std::size_t first = model.first_dof(joint.index);
  const auto& dofs = joint.joint->dofs;
  std::array<double, 6> rates{};
  if (std::any_of(dofs.begin(), dofs.end(), [](const Dof& dof) { return dof.armature > 0; }))
    rates = rates_before(joint, bodies, std::span(state.coordinates).subspan(first), options.h);
  for (std::size_t i = 0; i < joint.chain.dofs; ++i) {
    const Dof& dof = joint.joint->dofs[i];
    if (!has_rows(dof)) continue;
    const double s = joint.scale(i);
    const DofRow d{&dof,
                   static_cast<Index>(first + i),
                   s,
                   state.coordinates[first + i],
                   dof.motor.kind == MotorKind::none ? 0 : state.targets[first + i],
                   state.dof_impulses[first + i],
                   joint_row(joint, s * joint.duals[i]),
                   dof.armature > 0 ? s * rates[i] : 0};
    append_drive(joint, d, options, rows);
    const double motor_speed = append_motor(joint, d, bodies, options, rows);
    append_friction(joint, d, options, rows);
    append_limits(joint, d, motor_speed, bodies, options, rows);
  }
}

// The rotation vector r of the ball has r' = omega to first order in r, and d|r|/dt = <omega, r / |r|>
// exactly.
void append_ball_rows(const JointContext& joint, const std::vector<BodyFrame>& bodies, const State& state,
                      const JointOptions& options, JointRows& rows) {
  const Joint& ball = *joint.joint;
  const double h = options.h, s = options.length;
  const Vec3& r = joint.chain.error.angular;
  const Vec3& last = state.ball_impulses[joint.index];
  const auto rotation_row = [&](const Vec3& axis) { return joint_row(joint, {{}, s * axis}); };
  const auto tag = [&](RowKind kind, Index dof) { return RowTag{kind, joint.index, dof, 1, {}, {}, s}; };
  const double stiff = (h * h * ball.ball_stiffness + h * ball.ball_damping) / (s * s);
  for (int axis = 0; stiff > 0 && axis < 3; ++axis) {
    rows.cones.add_free(1);
    append_row(rows, rotation_row(ball_component(axis, 1)), 1 / stiff,
               h * ball.ball_stiffness * r[axis] / (s * stiff), last[axis] / s, tag(RowKind::ball, axis));
  }
  const double bound = h * ball.ball_friction / s;
  for (int axis = 0; bound > 0 && axis < 3; ++axis) {
    add_interval(rows, bound);
    // The state holds the sum with the spring and damper, which then take all of it.
    const double x0 = stiff > 0 ? 0 : std::clamp(last[axis] / s, -bound, bound);
    append_row(rows, rotation_row(ball_component(axis, 1)), 0, 0, x0, tag(RowKind::ball, axis));
  }
  const double angle = norm(r);
  if (!(ball.ball_limit < infinity) || angle < 1e-9) return;
  const Vec3 axis = r / angle;
  const JacobianRow row = -1.0 * rotation_row(axis);
  const double gap = s * (ball.ball_limit - angle);
  if (!within_reach(bodies, row, gap, 0, options)) return;
  RowTag limit = tag(RowKind::limit, -1);
  limit.torque = -s * axis;
  rows.cones.add_nonnegative(1);
  append_row(rows, row, 0, std::max(gap / h, -options.recovery_speed),
             std::max(-dot(axis, state.joint_wrenches[joint.index].torque) / s, 0.0), limit);
}

void append_distance_rows(const JointContext& joint, const std::vector<BodyFrame>& bodies, const State& state,
                          const JointOptions& options, JointRows& rows) {
  const Joint& rod = *joint.joint;
  const Vec3& between = joint.pose.relative.position;
  const double distance = norm(between);
  // Where the points coincide no direction is better than another; the next step knows one.
  const Vec3 direction = distance > 1e-12 * options.length ? between / distance : Vec3{0, 0, 1};
  const double last = dot(direction, state.joint_wrenches[joint.index].force);
  const JacobianRow row = joint_row(joint, {direction, {}});
  const bool soft = rod.compliance > 0, fixed = rod.lower_distance == rod.upper_distance;
  const double spring = rod.compliance / (options.h * options.h);
  const double rigid = locked_regularisation * inverse_effective_mass(bodies, row);
  RowTag tag{fixed ? RowKind::locked : RowKind::distance, joint.index, -1};
  if (fixed) {
    const double error = distance - rod.lower_distance;
    rows.cones.add_free(1);
    tag.force = direction;
    append_row(rows, row, soft ? spring : rigid, soft ? error / options.h : recovery(error, options), last,
               tag);
    return;
  }
  for (const double sign : {1.0, -1.0}) {
    const double gap = sign > 0 ? distance - rod.lower_distance : rod.upper_distance - distance;
    // A lower distance of zero is no constraint.
    if ((sign > 0 && rod.lower_distance == 0) || !(gap < infinity) ||
        !within_reach(bodies, row, gap, 0, options))
      continue;
    rows.cones.add_nonnegative(1);
    tag.force = sign * direction;
    append_row(rows, sign * row, spring,
               soft ? gap / options.h : std::max(gap / options.h, -options.recovery_speed),
               std::max(sign * last, 0.0), tag);
  }
}

}  // namespace amontons
