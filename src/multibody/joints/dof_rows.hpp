#pragma once
#include "amontons/multibody/joints/rows.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

// Along each degree of freedom of a chain: the drive (spring, damper and armature), motor, dry friction and
// limits.
void append_dof_rows(const Model& model, const JointContext& joint, const StepBodies& bodies,
                     const State& state, const JointOptions& options, JointRows& rows);

}  // namespace amontons
