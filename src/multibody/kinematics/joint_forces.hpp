#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/kinematics/tree.hpp"

namespace amontons {

struct JointContext;  // a joint in the world, joints/joint_context.hpp

// Adds the impulses over `kick` of forces along qd to the loads of dynamic bodies. `joints`: all joints of
// the model in the present pose; `forces`: empty for none.
void add_joint_forces(const Tree& tree, const BodyFrames& bodies, std::span<const JointContext> joints,
                      std::span<const double> forces, double kick, std::vector<BodyImpulse>& loads);

}  // namespace amontons
