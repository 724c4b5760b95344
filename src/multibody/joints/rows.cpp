#include "amontons/multibody/joints/rows.hpp"

#include <algorithm>

namespace amontons {

void JointRows::clear() {
  jacobian.clear();
  compliance.clear();
  c.clear();
  x0.clear();
  cones = SetProduct();
  tags.clear();
  efforts.clear();
  auxiliary_inverse_mass.clear();
}

void JointRows::append(const JacobianRow& row, double row_compliance, double bias, double start,
                       const RowTag& tag) {
  jacobian.push_back(row);
  compliance.push_back(row_compliance);
  c.push_back(bias);
  x0.push_back(start);
  tags.push_back(tag);
}

namespace {

void clear_impulses(State& state) {
  std::fill(state.joint_wrenches.begin(), state.joint_wrenches.end(), JointWrench{});
  std::fill(state.dof_impulses.begin(), state.dof_impulses.end(), DofImpulse{});
  std::fill(state.ball_impulses.begin(), state.ball_impulses.end(), Vec3{});
  std::fill(state.coupling_impulses.begin(), state.coupling_impulses.end(), 0.0);
}

// Several rows may act on one coordinate (both limits): impulses add.
void store(const RowTag& tag, double x, State& state) {
  const double along = tag.sign * tag.scale * x;
  switch (tag.kind) {
    case RowKind::drive:
      state.dof_impulses[tag.dof].drive += along;
      return;
    case RowKind::motor:
      state.dof_impulses[tag.dof].motor += along;
      return;
    case RowKind::friction:
      state.dof_impulses[tag.dof].friction += along;
      return;
    case RowKind::ball:
      state.ball_impulses[tag.joint][tag.dof] += along;
      return;
    case RowKind::coupling:
      if (tag.dof >= 0) state.coupling_impulses[tag.joint] = along;
      return;
    case RowKind::limit:
      if (tag.dof >= 0) {
        state.dof_impulses[tag.dof].limit += along;
        return;
      }
      break;  // the limit of a ball
    case RowKind::locked:
    case RowKind::distance:
      break;
  }
  JointWrench& wrench = state.joint_wrenches[tag.joint];
  wrench.force += x * tag.force;
  wrench.torque += x * tag.torque;
}

}  // namespace

void store_joint_impulses(const JointRows& rows, std::span<const double> x, State& state) {
  clear_impulses(state);
  for (const KnownImpulse& effort : rows.efforts) state.dof_impulses[effort.dof].motor = effort.impulse;
  for (std::size_t i = 0; i < rows.tags.size(); ++i) store(rows.tags[i], x[i], state);
}

}  // namespace amontons
