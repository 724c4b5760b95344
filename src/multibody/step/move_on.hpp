// Stage 8 of a step.
#pragma once
#include "multibody/step/observe.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// Stores impulses in the observed contacts, for the user, and in the state, for the next step. Then moves the
// bodies of the state by the velocities after the impulses. Notes which islands jump.
void move_on(const StepSetting& step, const StepProblem& posed, Solved& solved, Observed& observed,
             State& state);

}  // namespace amontons
