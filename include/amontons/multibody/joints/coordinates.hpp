#pragma once
#include "amontons/multibody/bodies/bodies.hpp"

namespace amontons {

// Renews state.coordinates from the poses, next to the coordinates there (so that turns are counted). A joint
// whose coordinates are all zero is searched from several starts, and the turn of a single hinge is the one
// within the limits, if any is.
void update_coordinates(const Model& model, const std::vector<BodyFrame>& bodies, State& state);

// Bodies at their initial poses and velocities, coordinates found from the poses, no loads.
State initial_state(const Model& model);

}  // namespace amontons
