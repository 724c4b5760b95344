// The forces of a surrounding fluid.
#pragma once
#include <vector>

#include "multibody/bodies/motion.hpp"

namespace amontons {

// Adds the impulses of the fluid on the boxes of bodies over the step h (about their centres of mass).
void add_fluid_loads(const Model& model, const BodyFrames& frames, const BodyMobilities& mobility,
                     const BodyVelocities& v, double h, std::vector<BodyImpulse>& loads);

}  // namespace amontons
