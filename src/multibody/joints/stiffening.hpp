#pragma once
#include <vector>

#include "multibody/joints/joint_context.hpp"

namespace amontons {

// Adds the geometric stiffness of the joints' forces of the last step to the effective inertia, if the step
// is too long to resolve it. `mobility` becomes that of this inertia, and `added` is what the inertia of each
// body gains. Returns whether any body needs it.
bool stiffen_rotations(const Model& model, const State& state, double h, double kick,
                       const BodyFrames& frames, const JointContexts& joints, std::vector<Mat3>& added,
                       BodyMobilities& mobility);

}  // namespace amontons
