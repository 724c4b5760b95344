#include "amontons/multibody/joints/measures.hpp"

#include <algorithm>

#include "multibody/joints/couplings.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

namespace {

// How far the distance of the two points lies outside its range, >= 0 if it does.
double excess(const Joint& rod, const Transform& relative) {
  const double distance = norm(relative.position);
  return std::max(distance - rod.upper_distance, rod.lower_distance - distance);
}

// Twice what the locked directions of a compliant joint and the rotation of a ball hold: 1/2 C^2 / e at the
// violation C with the compliance e. Angles of locked directions count as lengths, as in their rows.
double locked_springs(const Model& model, std::size_t j, const std::vector<BodyFrame>& bodies,
                      const State& state) {
  const Joint& joint = model.joint(static_cast<Index>(j));
  if (joint.compliance == 0 && joint.ball_stiffness == 0) return 0;
  const Transform relative = joint_pose(joint, bodies).relative;
  if (!is_chain(joint)) {
    const double stretch = std::max(0.0, excess(joint, relative));
    return stretch * stretch / joint.compliance;
  }
  const ChainKinematics chain = chain_kinematics(joint, relative, coordinates_of(model, state, j));
  const double turn = norm_squared(chain.error.angular), length = model.length();
  const double ball = chain.spherical ? joint.ball_stiffness * turn : 0;
  if (joint.compliance == 0) return ball;
  const double locked_turn = chain.spherical ? 0 : length * length * turn;
  return ball + (norm_squared(chain.error.linear) + locked_turn) / joint.compliance;
}

}  // namespace

JointError joint_error(const Model& model, const std::vector<BodyFrame>& bodies, const State& state) {
  JointError worst;
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint) || joint.compliance > 0) continue;
    const Transform relative = joint_pose(joint, bodies).relative;
    if (!is_chain(joint)) {
      worst.distance = std::max(worst.distance, excess(joint, relative));
      continue;
    }
    const ChainKinematics chain = chain_kinematics(joint, relative, coordinates_of(model, state, j));
    worst.distance = std::max(worst.distance, norm(chain.error.linear));
    if (!chain.spherical) worst.angle = std::max(worst.angle, norm(chain.error.angular));
  }
  return worst;
}

double spring_energy(const Model& model, const std::vector<BodyFrame>& bodies, const State& state) {
  double twice = 0;
  for (std::size_t j = 0; j < model.joints(); ++j) {
    const Joint& joint = model.joint(static_cast<Index>(j));
    if (!is_active(model, joint)) continue;
    const std::span<const double> q = coordinates_of(model, state, j);
    for (std::size_t i = 0; i < q.size(); ++i) {
      const double stretch = q[i] - joint.dofs[i].rest;
      twice += joint.dofs[i].stiffness * stretch * stretch;
    }
    twice += locked_springs(model, j, bodies, state);
  }
  for (const Coupling& coupling : model.description().couplings) {
    const double violation = coupling_value(model, coupling, state).violation;
    if (coupling.compliance > 0) twice += violation * violation / coupling.compliance;
  }
  return 0.5 * twice;
}

}  // namespace amontons
