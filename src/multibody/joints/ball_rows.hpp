#pragma once
#include "amontons/multibody/joints/rows.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

// The free rotation of a ball joint: spring and damper, dry friction, and the limit of its angle.
void append_ball_rows(const JointContext& joint, const StepBodies& bodies, const State& state,
                      const JointOptions& options, JointRows& rows);

}  // namespace amontons
