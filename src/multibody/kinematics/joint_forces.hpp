#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/model/state.hpp"

namespace amontons {

struct JointContext;  // a joint in the world, joints/joint_context.hpp

// Adds the impulses over h of state.joint_forces to the loads of dynamic bodies. `joints`: all joints of the
// model in the present pose.
void add_joint_forces(const Tree& tree, const BodyFrames& bodies, std::span<const JointContext> joints,
                      const State& state, double h, std::vector<BodyImpulse>& loads);

}  // namespace amontons
