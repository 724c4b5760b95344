#pragma once
#include <span>

#include "amontons/base/budget.hpp"
#include "amontons/multibody/step/simulation_options.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/options.hpp"
#include "multibody/step/clock.hpp"
#include "multibody/step/light_body_error.hpp"
#include "multibody/step/step_problem.hpp"
#include "multibody/step/step_sums.hpp"

namespace amontons {

// Method, options and budget that solves of one step share.
struct StepSolver {
  const SimulationOptions& simulation;
  StepClock& clock;
  Budget& budget;
  Elimination& elimination;  // memory of `auto`, kept between steps
  StepSums& sums;            // all solves are counted here
  Speeds fastest;            // at the start, including the velocity that gravity adds

  bool is_auto() const { return !simulation.own_method && simulation.method == "auto"; }
  // Without the start, which each solve sets.
  Options options() const;
};

// Work limit (Budget units) of a step with `blocks` contacts and joint rows.
double most_work(std::size_t blocks);

// The start of a solve, the impulses of the last step; empty: zero.
struct StepStart {
  std::span<const double> x0;
  bool again = false;  // or of an earlier solve of this step
};
// Solves a VI of the step. `memory` is a solution whose arrays are used again.
Solution solve_step(const StepSolver& solver, const Problem& problem, StepStart start, Solution memory = {});
// The same without the islands at rest: find_rest() has put their start, which is their solution, into
// solved.solution.
void solve_beside(const StepSolver& solver, const StepProblem& posed, const Sleepers& asleep, Solved& solved);

}  // namespace amontons
