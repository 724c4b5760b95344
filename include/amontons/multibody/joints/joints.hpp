#pragma once
#include <span>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/joints/rows.hpp"

namespace amontons {

struct JointContext;  // a joint in the world, src/multibody/joints/joint_context.hpp

// Appends the rows of every joint, spring, limit, motor, friction, tendon, actuator and coupling of the
// model. Joints between bodies that are not dynamic have none.
// - Locked directions are taken back within the step, but no faster than recovery_speed (angles times
//   length).
// - Limits have rows only within reach: twice the way of the start or free velocity, or a tenth of length (or
//   0.1 rad).
// - A position motor without gain reaches its target within the step, but moves no more than `length` or a
//   quarter turn, so that turns can be counted and a target that jumps does not fling the bodies; nor is it
//   faster than half of its max_effort can brake. A rigid motor without max_effort stops at the limits.
// - The friction of a ball joint bounds each component of the torque in frame_b: along a diagonal it holds up
//   to sqrt(3) as much.
// `joints`: all of the model where the bodies stand.
void append_joint_rows(const Model& model, const StepBodies& bodies, std::span<const JointContext> joints,
                       const State& state, const JointOptions& options, JointRows& rows);

// Adds the impulses over h of effort motors to the loads of dynamic bodies.
void add_motor_loads(const Model& model, std::span<const JointContext> joints, const State& state, double h,
                     std::vector<BodyImpulse>& loads);

}  // namespace amontons
