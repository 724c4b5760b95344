#pragma once
#include "amontons/multibody/bodies/bodies.hpp"

namespace amontons {

// Adds the impulses over h of effort motors to the loads of dynamic bodies.
void add_motor_loads(const Model& model, const std::vector<BodyFrame>& bodies, const State& state, double h,
                     std::vector<BodyImpulse>& loads);

}  // namespace amontons
