#pragma once
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"

namespace amontons {

// Adds the geometric stiffness of the joints' forces to the inertia that impulses feel, where the step is too
// long to resolve it: `stiffened` becomes `mobility` with that inertia. Returns whether any body needs it,
// and leaves `stiffened` alone if none does. `sums` is scratch.
bool stiffen_rotations(const Model& model, const State& state, double h, const std::vector<BodyFrame>& frames,
                       const std::vector<BodyMobility>& mobility, std::vector<Mat3>& sums,
                       std::vector<BodyMobility>& stiffened);

}  // namespace amontons
