#include "amontons/multibody/joints/joints.hpp"

#include <algorithm>
#include <cmath>

#include "multibody/joints/joint_kinematics.hpp"

namespace amontons {

void JointRows::clear() {
  jacobian.clear();
  compliance.clear(), c.clear(), x0.clear();
  cones = SetProduct();
  tags.clear(), efforts.clear();
  auxiliary_inverse_mass.clear();
}

void append_joint_rows(const Model& model, const std::vector<BodyFrame>& bodies, const State& state,
                       const JointOptions& options, JointRows& rows) {
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint)) continue;
    const JointContext context = joint_context(model, bodies, state, j);
    if (!is_chain(joint)) {
      append_distance_rows(context, bodies, state, options, rows);
      continue;
    }
    append_locked_rows(context, bodies, state, options, rows);
    append_dof_rows(model, context, bodies, state, options, rows);
    if (joint.spherical) append_ball_rows(context, bodies, state, options, rows);
  }
  append_coupling_rows(model, bodies, state, options, rows);
}

void add_motor_loads(const Model& model, const std::vector<BodyFrame>& bodies, const State& state, double h,
                     std::vector<Vec3>& impulse_force, std::vector<Vec3>& impulse_torque) {
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    const auto is_effort = [](const Dof& dof) { return dof.motor.kind == MotorKind::effort; };
    if (!is_active(model, joint) || std::none_of(joint.dofs.begin(), joint.dofs.end(), is_effort)) continue;
    const JointContext context = joint_context(model, bodies, state, j);
    for (std::size_t i = 0; i < joint.dofs.size(); ++i) {
      if (!is_effort(joint.dofs[i])) continue;
      const double bound = joint.dofs[i].motor.max_effort;
      const double impulse = h * std::clamp(state.targets[model.first_dof(j) + i], -bound, bound);
      const JacobianRow row = joint_row(context, impulse * context.duals[i]);
      const auto add = [&](Index body, const std::array<double, 6>& w) {
        if (!model.is_dynamic(body)) return;
        impulse_force[body] += Vec3{w[0], w[1], w[2]};
        impulse_torque[body] += Vec3{w[3], w[4], w[5]};
      };
      add(row.body_a, row.a);
      add(row.body_b, row.b);
    }
  }
}

void store_joint_impulses(const JointRows& rows, std::span<const double> x, State& state) {
  std::fill(state.joint_wrenches.begin(), state.joint_wrenches.end(), JointWrench{});
  std::fill(state.dof_impulses.begin(), state.dof_impulses.end(), DofImpulse{});
  std::fill(state.ball_impulses.begin(), state.ball_impulses.end(), Vec3{});
  std::fill(state.coupling_impulses.begin(), state.coupling_impulses.end(), 0.0);
  for (const KnownImpulse& effort : rows.efforts) state.dof_impulses[effort.dof].motor = effort.impulse;
  for (std::size_t i = 0; i < rows.tags.size(); ++i) {
    const RowTag& tag = rows.tags[i];
    const double along = tag.sign * tag.scale * x[i];
    switch (tag.kind) {
      case RowKind::drive:
        state.dof_impulses[tag.dof].drive += along;
        break;
      case RowKind::motor:
        state.dof_impulses[tag.dof].motor += along;
        break;
      case RowKind::friction:
        state.dof_impulses[tag.dof].friction += along;
        break;
      case RowKind::ball:
        state.ball_impulses[tag.joint][tag.dof] += along;
        break;
      case RowKind::coupling:
        if (tag.dof >= 0) state.coupling_impulses[tag.joint] = along;
        break;
      case RowKind::limit:
        if (tag.dof >= 0) {
          state.dof_impulses[tag.dof].limit += along;
          break;
        }
        [[fallthrough]];  // the limit of a ball
      case RowKind::locked:
      case RowKind::distance: {
        JointWrench& wrench = state.joint_wrenches[tag.joint];
        wrench.force += x[i] * tag.force, wrench.torque += x[i] * tag.torque;
        break;
      }
    }
  }
}

JointError joint_error(const Model& model, const std::vector<BodyFrame>& bodies, const State& state) {
  JointError worst;
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint) || joint.compliance > 0) continue;
    const Transform relative = joint_pose(joint, bodies).relative;
    if (!is_chain(joint)) {
      const double distance = norm(relative.position);
      worst.distance =
          std::max({worst.distance, distance - joint.upper_distance, joint.lower_distance - distance});
      continue;
    }
    const std::span<const double> q(state.coordinates);
    const ChainKinematics chain =
        chain_kinematics(joint, relative, q.subspan(model.first_dof(j), joint.dofs.size()));
    worst.distance = std::max(worst.distance, norm(chain.error.linear));
    if (!chain.spherical) worst.angle = std::max(worst.angle, norm(chain.error.angular));
  }
  return worst;
}

double spring_energy(const Model& model, const std::vector<BodyFrame>& bodies, const State& state) {
  double twice = 0;
  const double length = model.length();
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint)) continue;
    for (std::size_t i = 0; i < joint.dofs.size(); ++i) {
      const double stretch = state.coordinates[model.first_dof(j) + i] - joint.dofs[i].rest;
      twice += joint.dofs[i].stiffness * stretch * stretch;
    }
    if (joint.compliance == 0 && joint.ball_stiffness == 0) continue;
    const Transform relative = joint_pose(joint, bodies).relative;
    if (!is_chain(joint)) {
      const double distance = norm(relative.position);
      const double stretch =
          std::max({0.0, distance - joint.upper_distance, joint.lower_distance - distance});
      twice += stretch * stretch / joint.compliance;
      continue;
    }
    const std::span<const double> q(state.coordinates);
    const ChainKinematics chain =
        chain_kinematics(joint, relative, q.subspan(model.first_dof(j), joint.dofs.size()));
    const double turn = norm_squared(chain.error.angular);
    if (chain.spherical) twice += joint.ball_stiffness * turn;
    if (joint.compliance > 0)
      twice += (norm_squared(chain.error.linear) + (chain.spherical ? 0 : length * length * turn)) /
               joint.compliance;
  }
  for (const Coupling& coupling : model.description().couplings) {
    const double violation = coupling_value(model, coupling, state).violation;
    if (coupling.compliance > 0) twice += violation * violation / coupling.compliance;
  }
  return 0.5 * twice;
}

}  // namespace amontons
