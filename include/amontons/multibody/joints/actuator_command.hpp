#pragma once
#include <span>

#include "amontons/multibody/model/model.hpp"
#include "amontons/multibody/model/state.hpp"

namespace amontons {

// The controls that actuators follow in a step of length h.
struct ActuatorCommand {
  const Model& model;
  const State& state;
  std::span<const double> controls;
  double h;
};

// A length and its rate: m and m/s, or rad and rad/s.
struct LineState {
  double length, rate;
};

}  // namespace amontons
