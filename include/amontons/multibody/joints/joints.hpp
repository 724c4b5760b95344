#pragma once
#include <span>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"

namespace amontons {

struct JointContext;  // a joint in the world, src/multibody/joints/joint_context.hpp

// Appends the rows of every joint, spring, limit, motor, friction, tendon, actuator and coupling of the
// model. Joints between bodies that are not dynamic have no rows.
// - Errors of locked directions are removed within the step, but no faster than recovery_speed (angles times
//   length).
// - Limits have rows only within reach: twice the travel at the start or free velocity, or a tenth of length
//   (or 0.1 rad).
// - A position motor without gain reaches its target within the step, but moves by at most `length` or a
//   quarter turn. So turns can be counted, and a jump of the target does not fling the bodies. It is no
//   faster than half of its max_effort can brake. A rigid motor without max_effort stops at the limits.
// - The friction of a ball joint bounds each component of the torque in frame_b: along a diagonal it holds up
//   to sqrt(3) as much.
// `joints`: all joints of the model in the present pose.
void append_joint_rows(const Model& model, const StepBodies& bodies, std::span<const JointContext> joints,
                       const State& state, const JointOptions& options, JointRows& rows);

// Adds the impulses over `kick` of effort motors with these controls to the loads of dynamic bodies.
void add_motor_loads(const Model& model, std::span<const JointContext> joints,
                     std::span<const double> controls, double kick, std::vector<BodyImpulse>& loads);

}  // namespace amontons
