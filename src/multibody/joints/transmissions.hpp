#pragma once
#include "multibody/joints/wide_rows.hpp"

// Transmissions of actuators that are neither a degree of freedom nor a tendon.
namespace amontons {

// Length and row of a wrench or a slider-crank; the row is that of the effort along it.
Line transmission_line(const Model& model, const BodyFrames& bodies, const Transmission& transmission);

// Change of the length of a pure torque over a full turn; 0 for other transmissions.
double turn_of(const Transmission& transmission);

}  // namespace amontons
