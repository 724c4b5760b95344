#pragma once
#include "amontons/multibody/joints/rows.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

// The distance of the two frame origins: a rod of one length, or the ends of a range (a rope, a strut).
void append_distance_rows(const JointContext& joint, const StepBodies& bodies, const State& state,
                          const JointOptions& options, JointRows& rows);

}  // namespace amontons
