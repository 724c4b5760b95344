// Bonds: points at which two bodies hold together until they are too far apart.
#pragma once
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"

namespace amontons {

// Adds the impulses over `kick` by which the bonds that are not broken pull their bodies together (about the
// centres of mass).
void add_bond_loads(const Model& model, const BodyFrames& frames, const State& state, double kick,
                    std::vector<BodyImpulse>& loads);

// Takes note of the distances in the poses of the state, from which a bond is broken or not.
void open_bonds(const Model& model, State& state);

}  // namespace amontons
