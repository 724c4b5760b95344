// The velocities that a step leaves in the state.
#pragma once
#include <vector>

#include "multibody/step/observe.hpp"
#include "multibody/step/setting.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// `ahead`: per body, the share of the change of its velocity over the kick by which the velocity at the end
// of the step leads that in its middle. It is half of the step over the kick where motion is smooth, so that
// the velocity is of second order. It is zero where velocities jump: a jump does not go on. Impacts at the
// start of the step are over.
void find_ahead(const StepSetting& step, const StepProblem& posed, double last_kick, const Observed& o,
                Solved& solved, std::vector<double>& ahead);

}  // namespace amontons
