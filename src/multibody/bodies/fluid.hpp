// The forces of a surrounding fluid.
#pragma once
#include <vector>

#include "multibody/bodies/motion.hpp"

namespace amontons {

// Adds the impulses of the fluid on the boxes of bodies over `kick` (about their centres of mass), at the
// velocities in the state. `stopped`, per body: drag takes most of a motion within it.
void add_fluid_loads(const Model& model, const StepBodies& bodies, const State& state, double kick,
                     std::vector<BodyImpulse>& loads, std::vector<unsigned char>& stopped);

}  // namespace amontons
