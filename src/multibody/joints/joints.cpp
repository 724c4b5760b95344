// The rows of joints: locked directions, rods and ropes, balls. Those along degrees of freedom are in
// dof_rows, those between joints in couplings. Each function provides C and D of its constraint; row_terms
// derives E, c and the set. All rows are velocities in m/s: D of an angle has the factor length.
#include "amontons/multibody/joints/joints.hpp"

#include <algorithm>

#include "amontons/base/policy.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/joints/actuator_rows.hpp"
#include "multibody/joints/clearance_rows.hpp"
#include "multibody/joints/couplings.hpp"
#include "multibody/joints/dof_rows.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/row_terms.hpp"
#include "multibody/joints/tendons.hpp"

namespace amontons {
namespace {

// The locked directions of a chain: C_i = <w_i, error>, with w_i the wrenches that do no work on the dofs and
// `error` the small motion from T(q) to the pose. The error changes with the twist of A relative to B minus
// sum_k screws_k q'_k. As <w_i, screws_k> = 0 the unknown q' drops out, and D v = <w_i, twist> is the row of
// w_i (exact at C = 0).
void append_locked_rows(const RowInput& in, const JointContext& joint, JointRows& rows) {
  const double L = joint.length;
  const JointWrench& last = in.state.joint_wrenches[joint.index];
  // The stored wrench is about the origin of frame_a; the rows are about the reference.
  const Vec3 last_torque = last.torque - cross(joint.arm, last.force);
  for (const Screw& w : std::span(joint.locked).first(joint.locked_count)) {
    // The last impulse in this basis, which is orthonormal with respect to <f, f> + <t, t> / L^2. The basis
    // may have turned since then, the wrench has not; the state therefore stores wrenches and not rows.
    const double x0 = dot(w.linear, last.force) + dot(w.angular, last_torque) / (L * L);
    RowTag tag{RowKind::locked, joint.index, -1};
    tag.force = w.linear;
    tag.torque = w.angular + cross(joint.arm, w.linear);
    append_equality(in, {joint_row(joint, w), x0, tag}, dot(w, joint.chain.error), joint.joint->compliance,
                    rows);
  }
}

// The distance of the two frame origins: a rod of one length, or the ends of a range (a rope, a strut). C =
// |p| - L with p from the origin of frame_b to that of frame_a: D v = <p / |p|, v_A - v_B>. Both velocities
// are taken at the origin of frame_a; the contribution of the turn of B there is normal to p.
void append_distance_rows(const RowInput& in, const JointContext& joint, JointRows& rows) {
  const Joint& rod = *joint.joint;
  const Vec3& between = joint.pose.relative.position;
  const double distance = norm(between);
  // If the points coincide the direction is arbitrary; the next step has one.
  const Vec3 direction = distance > base::policy.rounding * joint.length ? between / distance : Vec3{0, 0, 1};
  const double last = dot(direction, in.state.joint_wrenches[joint.index].force);
  const JacobianRow row = joint_row(joint, {direction, {}});
  if (rod.lower_distance == rod.upper_distance) {
    RowTag tag{RowKind::locked, joint.index, -1};
    tag.force = direction;
    append_equality(in, {row, last, tag}, distance - rod.lower_distance, rod.compliance, rows);
    return;
  }
  // Ends of the range: C = |p| - lower >= 0 pushes the points apart, C = upper - |p| >= 0 pulls them
  // together.
  for (const double sign : {1.0, -1.0}) {
    if (sign > 0 && rod.lower_distance == 0) continue;  // no distance is negative
    const double gap = sign > 0 ? distance - rod.lower_distance : rod.upper_distance - distance;
    RowTag tag{RowKind::distance, joint.index, -1};
    tag.force = sign * direction;
    append_inequality(in, {sign * row, sign * last, tag}, gap, rod.compliance, 0, rows);
  }
}

// The spin relative to which the solve measures the change over the step. The solve uses the mean spin W of a
// torque-free turn in place of the spin W0 at the start. The turn itself changes the spin by 2 (W - W0), of
// which W contains half (bodies/motion.cpp): W - (2 W0 - W) is the whole change. The half before the start
// is that of the last step.
Vec3 spin_before(const RowInput& in, Index body) {
  if (body < 0) return {};
  const Vec3& spin = in.bodies.start[body].angular;
  if (!in.model.is_dynamic(body)) return spin;
  const Quat& turn = in.bodies.frames[body].pose.rotation;
  const JointOptions& o = in.options;
  const Vec3 mean = torque_free_mean(in.model.body(body).inertia, rotate(conjugate(turn), spin), o.h);
  return spin - (o.last() / o.h) * (rotate(turn, mean) - spin);
}

// Spin of A relative to B, in the axes of frame_b. The inertia of the drive turns with A. Its torque is a
// times the rate of the spin's components in A, which is the rate in space minus omega_A x spin.
Vec3 drive_spin_before(const RowInput& in, const JointContext& joint) {
  const auto [a, b] = std::pair{joint.joint->body_a, joint.joint->body_b};
  const Vec3& omega = in.bodies.start[a].angular;
  const Vec3 spin = omega - (b < 0 ? Vec3{} : in.bodies.start[b].angular);
  const Vec3 before = spin_before(in, a) - spin_before(in, b) + in.options.kick * cross(omega, spin);
  return rotate(conjugate(joint.pose.b.rotation), before);
}

// The free rotation of a ball joint: spring and damper, dry friction, and the limit of its angle. The
// rotation vector r of the ball has r' = omega to first order in r, and d|r|/dt = <omega, r / |r|> exactly.
// Rows about the axes of frame_b are D v = s omega_i, with s = length.
void append_ball_rows(const RowInput& in, const JointContext& joint, JointRows& rows) {
  const Joint& ball = *joint.joint;
  const double kick = in.options.kick, s = joint.length;
  const Vec3& r = joint.chain.error.angular;
  const Vec3& last = in.state.ball_impulses[joint.index];
  const auto rotation_row = [&](const Vec3& about) { return joint_row(joint, {{}, s * about}); };
  const auto axis = [](int k) { return Vec3{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0}; };
  const auto tag_of = [&](RowKind kind, Index k) { return RowTag{kind, joint.index, k, 1, {}, {}, s}; };

  // Spring k towards r = 0, damper d and inertia a, as the drive of a dof (append_passive). r' = omega to
  // first order. omega - omega- is the change of the spin over the step (spin_before).
  const double inertia = joint.in_tree ? 0 : ball.ball_armature;  // M of trees has it
  const double damping = in.options.dampers ? ball.ball_damping : 0;
  const bool driven = ball.ball_stiffness > 0 || damping > 0 || inertia > 0;
  const Vec3 before = inertia > 0 ? drive_spin_before(in, joint) : Vec3{};
  const double bound = kick * ball.ball_friction / s;
  // The state holds the sum of friction, spring and damper. The rate at the start gives the latter, and the
  // rest is the start of friction.
  Vec3 friction = last / s;
  for (int k = 0; driven && k < 3; ++k) {
    const JacobianRow row = rotation_row(axis(k));
    const double rate = row_velocity(row, in.bodies.start);
    const Drive drive{ball.ball_stiffness, r[k], damping, inertia, before[k], 0, rate / s};
    if (const auto terms = drive_terms(drive, s, inverse_effective_mass(row, in.bodies), in.options)) {
      friction[k] = std::clamp(friction[k] + (rate + terms->c) / terms->compliance, -bound, bound);
      rows.append(Bilateral{}, row, *terms, last[k] / s - friction[k], tag_of(RowKind::ball, k));
    }
  }
  for (int k = 0; bound > 0 && k < 3; ++k)
    append_bounded(bound, {rotation_row(axis(k)), friction[k], tag_of(RowKind::ball, k)}, {0, 0}, rows);

  // r| <= limit: C = s (limit - |r|), D = -s <omega, r / |r|>. Near r = 0 the direction is undefined, but no
  // limit is that small.
  const double angle = norm(r);
  if (!(ball.ball_limit < infinity) || angle < base::policy.rounding) return;
  const Vec3 outward = r / angle;
  RowTag tag = tag_of(RowKind::limit, -1);
  tag.torque = -s * outward;
  const double last_limit = -dot(outward, in.state.joint_wrenches[joint.index].torque) / s;
  append_inequality(in, {-1.0 * rotation_row(outward), last_limit, tag}, s * (ball.ball_limit - angle), 0, 0,
                    rows);
}

}  // namespace

// Rows of a joint are adjacent, followed by those of tendons and couplings, which may add auxiliary bodies.
// The order is that of the model, so that the same model gives the same bits.
void append_joint_rows(const Model& model, const StepBodies& bodies, std::span<const JointContext> joints,
                       const State& state, const JointOptions& options, JointRows& rows) {
  const RowInput in{model, bodies, joints, state, options};
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint) || (!options.left_out.empty() && options.left_out[j])) continue;
    const JointContext& context = joints[j];
    // A distance joint has no coordinates and locks at most one direction.
    if (!is_chain(joint)) {
      append_distance_rows(in, context, rows);
      continue;
    }
    if (!context.in_tree) append_locked_rows(in, context, rows);
    append_dof_rows(in, context, rows);
    if (joint.clearance > 0) append_clearance_rows(in, context, rows);
    if (joint.spherical) append_ball_rows(in, context, rows);
  }
  append_tendon_rows(in, rows);
  append_actuator_rows(in, rows);
  append_coupling_rows(in, rows);
}

// An effort motor has no row, because its impulse does not depend on the solve. The effort tau along dof i is
// the wrench tau dual_i on A and its opposite on B. This is D' of the dof's row, because a row's wrench is
// that of its unit impulse.
void add_motor_loads(const Model& model, std::span<const JointContext> joints,
                     std::span<const double> controls, double kick, std::vector<BodyImpulse>& loads) {
  const auto is_effort = [](const Dof& dof) { return dof.motor.kind == MotorKind::effort; };
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint) || std::none_of(joint.dofs.begin(), joint.dofs.end(), is_effort)) continue;
    const JointContext& context = joints[j];
    for (std::size_t i = 0; i < joint.dofs.size(); ++i) {
      if (!is_effort(joint.dofs[i])) continue;
      const double bound = joint.dofs[i].motor.max_effort;
      const double impulse =
          kick * std::clamp(controls[model.control_of_dof(model.first_dof(j) + i)], -bound, bound);
      add_wrenches(model, joint_row(context, impulse * context.duals[i]), 1, loads);
    }
  }
}

}  // namespace amontons
