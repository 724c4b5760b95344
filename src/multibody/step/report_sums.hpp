// Report of a step, from the values of its parts.
#pragma once
#include "amontons/multibody/step/report.hpp"
#include "multibody/step/observe.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// Adds a part of a step: the errors at its start, and its result.
void add_part(const PositionErrors& errors, const StepProblem& posed, const Solved& solved, double tolerance,
              StepSums& sums, Report& report);
// Energies at the end of a step.
void add_energies(const Model& model, State& state, const BodyFrames& frames,
                  const BodyVelocities& velocities, Report& report);

}  // namespace amontons
