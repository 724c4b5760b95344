#include "amontons/multibody/model/state.hpp"

#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "multibody/step/step.hpp"

namespace amontons {

State initial_state(const Model& model) {
  State s;
  for (const Body& body : model.description().bodies) {
    s.positions.push_back(body.pose.position);
    s.orientations.push_back(normalised(body.pose.rotation));
    s.linear_velocities.push_back(body.linear_velocity);
    s.angular_velocities.push_back(body.angular_velocity);
  }
  s.forces.resize(model.bodies());
  s.torques.resize(model.bodies());
  s.coordinates.resize(model.dofs());
  s.dof_impulses.resize(model.dofs());
  s.joint_wrenches.resize(model.joints());
  s.ball_impulses.resize(model.joints());
  s.coupling_impulses.resize(model.description().couplings.size());
  for (const Joint& joint : model.description().joints)
    for (const Dof& dof : joint.dofs) s.targets.push_back(dof.motor.target);
  std::vector<BodyFrame> frames;
  make_body_frames(model, s, frames);
  update_coordinates(model, frames, s);
  return s;
}

void validate(const Model& model, const State& s) {
  for (std::size_t i = 0; i < model.bodies(); ++i) {
    const auto who = [&] {
      const std::string& name = model.description().bodies[i].name;
      return name.empty() ? "body " + std::to_string(i) : "body \"" + name + "\"";
    };
    const Quat& q = s.orientations[i];
    AMONTONS_REQUIRE(is_finite(s.positions[i]), who() + ": the position is not finite");
    AMONTONS_REQUIRE(std::abs(norm(q) - 1) < 1e-6,
                     who() + ": the orientation is not a unit quaternion (w, x, y, z); normalise it");
    AMONTONS_REQUIRE(is_finite(s.linear_velocities[i]) && is_finite(s.angular_velocities[i]),
                     who() + ": the velocity is not finite");
    AMONTONS_REQUIRE(is_finite(s.forces[i]) && is_finite(s.torques[i]),
                     who() + ": the external force or torque is not finite");
  }
  for (std::size_t k = 0; k < s.targets.size(); ++k)
    AMONTONS_REQUIRE(std::isfinite(s.targets[k]),
                     "target " + std::to_string(k) + " of a motor is not finite");
}

}  // namespace amontons
