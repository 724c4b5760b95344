#pragma once
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/row_terms.hpp"

namespace amontons {

// Along each degree of freedom of a chain: the drive (spring, damper and armature), motor, dry friction and
// limits.
void append_dof_rows(const RowInput& in, const JointContext& joint, JointRows& rows);

}  // namespace amontons
