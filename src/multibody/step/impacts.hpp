// Stage 3 of a step.
#pragma once
#include "multibody/step/observe.hpp"
#include "multibody/step/solve_step.hpp"

namespace amontons {

// Impacts with restitution at the start of a step. Changes the start velocities from those before the impacts
// to those after. Adds the impulses to the contacts and stores those of the locked directions of each joint,
// as State does. Returns whether anything bounced.
bool resolve_impacts(const StepSetting& step, const StepSolver& solver, const State& state,
                     Observed& observed);

}  // namespace amontons
