#include "amontons/multibody/model/state.hpp"

#include <cmath>

#include "amontons/base/error.hpp"

namespace amontons {

// Called before every step, because users write into the state. Messages are only built when needed. Only
// inputs of the step are checked: coordinates follow from the poses, and impulses are only the start of a
// solve.
void validate(const Model& model, const State& s, const Subset& changed) {
  changed.each(model.bodies(), [&](std::size_t i) {
    const auto who = [&] {
      const std::string& name = model.description().bodies[i].name;
      return name.empty() ? "body " + std::to_string(i) : "body \"" + name + "\"";
    };
    const Quat& q = s.orientations[i];
    AMONTONS_REQUIRE(within(s.positions[i], largest_coordinate),
                     who() + ": the position is not finite, or beyond 1e15 m");
    AMONTONS_REQUIRE(std::abs(norm(q) - 1) < 1e-6,
                     who() + ": the orientation is not a unit quaternion (w, x, y, z); normalise it");
    AMONTONS_REQUIRE(within(s.linear_velocities[i], largest_coordinate) &&
                         within(s.angular_velocities[i], largest_coordinate),
                     who() + ": the velocity is not finite, or beyond 1e15 m/s or rad/s");
    AMONTONS_REQUIRE(within(s.forces[i], largest_load) && within(s.torques[i], largest_load),
                     who() + ": the external force or torque is not finite, or beyond 1e30 N or N m");
  });
  const auto& controls = model.controls();
  for (std::size_t k = 0; k < s.controls.size(); ++k) {
    if (controls[k].actuator >= 0)
      AMONTONS_REQUIRE(std::isfinite(s.controls[k]) && std::isfinite(s.activations[k]),
                       "actuator \"" + controls[k].name + "\": the control or activation is not finite");
    else
      AMONTONS_REQUIRE(std::abs(s.controls[k]) <= largest_load,
                       "motor of \"" + controls[k].name + "\": the control is not finite, or beyond 1e30");
  }
  for (std::size_t k = 0; k < s.joint_forces.size(); ++k)
    AMONTONS_REQUIRE(std::abs(s.joint_forces[k]) <= largest_load,
                     "joint_forces[" + std::to_string(k) + "] is not finite, or beyond 1e30 N or N m");
}

}  // namespace amontons
