#pragma once
#include "multibody/joints/wide_rows.hpp"

// What actuators move, where it is neither a degree of freedom nor a tendon.
namespace amontons {

// Length and row of a wrench or a slider-crank; the row is that of the effort along it.
Line transmission_line(const Model& model, const BodyFrames& bodies, const Transmission& transmission);

// What a full turn adds to the length of a wrench without force; 0 of any other transmission.
double turn_of(const Transmission& transmission);

}  // namespace amontons
