// The memory of the rows of a step, and the storage of their impulses in the state. A row is identified by
// its tag: rows appear and vanish between steps (limits, ropes), and the state must not depend on their
// numbers.
#include "amontons/multibody/joints/rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

namespace amontons {

// Array by array, so that each keeps its memory for the next step.
void JointRows::clear() {
  jacobian.clear();
  compliance.clear();
  c.clear();
  x0.clear();
  position.clear();
  restraint.clear();
  cones.clear();
  tags.clear();
  efforts.clear();
  auxiliary_inverse_mass.clear();
  past.clear();
}

namespace {

// Place of the impulse of a row along one coordinate; null for a row whose impulse is a wrench.
double* place_of(const RowTag& tag, State& state) {
  switch (tag.kind) {
    case RowKind::passive:
      return &state.dof_impulses[tag.dof].passive;
    case RowKind::motor:
      return &state.dof_impulses[tag.dof].motor;
    case RowKind::friction:
      return &state.dof_impulses[tag.dof].friction;
    case RowKind::limit:  // the limit of a ball has no coordinate
      return tag.dof >= 0 ? &state.dof_impulses[tag.dof].limit : nullptr;
    case RowKind::ball:
      return &state.ball_impulses[tag.joint][tag.dof];
    case RowKind::coupling:
      return &state.coupling_impulses[tag.joint];
    case RowKind::tendon: {
      TendonImpulse& tendon = state.tendon_impulses[tag.joint];
      return std::array{&tendon.passive, &tendon.spring, &tendon.friction, &tendon.limit}[tag.dof];
    }
    case RowKind::actuator:
      return &state.actuator_impulses[tag.joint];
    case RowKind::rub:
      return &state.rub_impulses[tag.joint];
    case RowKind::locked:
    case RowKind::clearance:
    case RowKind::distance:
      break;
  }
  return nullptr;
}

// Several rows may act on one coordinate (both limits) or one joint (its locked directions): impulses add.
void store(const RowTag& tag, double x, State& state) {
  // Helpers of a wide row repeat its impulse.
  if ((tag.kind == RowKind::coupling || tag.kind == RowKind::tendon) && tag.dof < 0) return;
  if (double* along = place_of(tag, state)) {
    *along += tag.sign * tag.scale * x;
    return;
  }
  JointWrench& wrench = state.joint_wrenches[tag.joint];
  wrench.force += x * tag.force;
  wrench.torque += x * tag.torque;
}

}  // namespace

// Efforts have no rows, hence no entry in x; the impulse of a motor that users read includes them.
void store_joint_impulses(const JointRows& rows, std::span<const double> x, State& state) {
  std::fill(state.joint_wrenches.begin(), state.joint_wrenches.end(), JointWrench{});
  std::fill(state.dof_impulses.begin(), state.dof_impulses.end(), DofImpulse{});
  std::fill(state.ball_impulses.begin(), state.ball_impulses.end(), Vec3{});
  std::fill(state.coupling_impulses.begin(), state.coupling_impulses.end(), 0.0);
  std::fill(state.rub_impulses.begin(), state.rub_impulses.end(), 0.0);
  std::fill(state.tendon_impulses.begin(), state.tendon_impulses.end(), TendonImpulse{});
  std::fill(state.actuator_impulses.begin(), state.actuator_impulses.end(), 0.0);
  for (const KnownImpulse& effort : rows.efforts) store(effort.tag, effort.impulse, state);
  for (std::size_t i = 0; i < rows.tags.size(); ++i) store(rows.tags[i], x[i], state);
}

// As for contacts, the trial point decides without a tolerance whether the friction slipped.
void store_slips(const JointRows& rows, const Problem& problem, const Solution& solution, double least,
                 State& state) {
  if (state.dof_slips.empty()) return;
  std::fill(state.dof_slips.begin(), state.dof_slips.end(), 0.0);
  const std::size_t contacts = problem.rows() - rows.tags.size();
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    if constexpr (std::is_same_v<S, Interval>) {
      if (row < contacts || rows.tags[row - contacts].kind != RowKind::friction) return;
      const RowTag& tag = rows.tags[row - contacts];
      const double u = solution.u[row], trial = solution.x[row] - u / problem.P[block];
      if (std::abs(u) > least && (trial < set.lo || trial > set.hi))
        state.dof_slips[tag.dof] = std::abs(u) / tag.scale;
    }
  });
}

}  // namespace amontons
