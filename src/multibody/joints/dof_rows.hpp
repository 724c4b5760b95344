#pragma once
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/row_terms.hpp"

namespace amontons {

// All bodies at the start of the last step; made once, because several rows use it.
const std::vector<Past>& past_of(const RowInput& in, JointRows& rows);

// The rates of a joint's coordinates q at the end of the last step, for the inertia of drives.
std::array<double, 6> rates_before(const RowInput& in, const JointContext& now, std::span<const double> q,
                                   JointRows& rows);

// For each degree of freedom of a chain: the drive (spring, damper and armature), motor, actuators, dry
// friction and limits.
void append_dof_rows(const RowInput& in, const JointContext& joint, JointRows& rows);

}  // namespace amontons
