#pragma once
#include "amontons/multibody/joints/rows.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

// The directions in which a chain does not move.
void append_locked_rows(const JointContext& joint, const StepBodies& bodies, const State& state,
                        const JointOptions& options, JointRows& rows);

}  // namespace amontons
