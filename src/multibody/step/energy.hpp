// Test whether a step created energy.
#pragma once
#include "multibody/step/observe.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// One solve and the velocities before and after it.
struct EnergyInput {
  const StepSetting& step;
  const Observed& o;
  const StepProblem& posed;
  const Solved& solved;
};

EnergyBalance energy_balance(const EnergyInput& in);

// Work (J) along the mean velocity, a quadratic in the impulses.
double work_along_mean(const EnergyInput& in);

}  // namespace amontons
