// Report of a step, from the values of its parts.
#pragma once
#include "amontons/multibody/step/report.hpp"
#include "multibody/step/observe.hpp"
#include "multibody/step/step_problem.hpp"
#include "multibody/step/step_sums.hpp"

namespace amontons {

// Adds a part of a step: the errors at its start, and its result.
void add_part(const PositionErrors& errors, const StepProblem& posed, const Solved& solved, double tolerance,
              StepSums& sums, Report& report);
// Energies at the end of a step. Coordinates of trees that the step has moved are exact already.
void add_energies(const Model& model, const Subset& visited, const std::vector<unsigned char>& without_rows,
                  State& state, const Observed& observed, Report& report);

}  // namespace amontons
