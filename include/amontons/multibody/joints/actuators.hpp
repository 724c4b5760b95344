#pragma once
#include <span>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/actuator_command.hpp"

namespace amontons {

struct JointContext;  // a joint in the world, src/multibody/joints/joint_context.hpp

// Adds the impulses over `kick` of actuators to the loads of dynamic bodies, if the effort is known before
// the step. This holds if it does not depend on length or rate, or pushes in their direction. `start`:
// velocities at the start of the step.
void add_actuator_loads(const ActuatorCommand& command, const BodyFrames& bodies,
                        std::span<const JointContext> joints, const BodyVelocities& start, double kick,
                        std::vector<BodyImpulse>& loads);

// Activations at the end of a step of length h, with the controls that the state holds.
void advance_activations(const Model& model, double h, State& state);

// Length and rate of every tendon, and of every actuator (gears applied): m and m/s, or rad and rad/s. They
// are those of the poses and velocities that the state holds.
std::vector<LineState> tendon_lines(const Model& model, const State& state);
std::vector<LineState> actuator_lines(const Model& model, const State& state);

}  // namespace amontons
