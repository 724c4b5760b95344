#pragma once
#include <span>

#include "amontons/base/budget.hpp"
#include "amontons/multibody/step/simulation_options.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/options.hpp"
#include "multibody/step/clock.hpp"
#include "multibody/step/light_body_error.hpp"
#include "multibody/step/rest.hpp"
#include "multibody/step/step_sums.hpp"

namespace amontons {

// The solver of one step: all its solves share method and options.
struct StepSolver {
  const SimulationOptions& simulation;
  StepClock& clock;
  Budget* budget;            // what this solve may spend
  Elimination& elimination;  // memory of `auto`, kept between steps
  StepSums& sums;            // all solves are counted here
  Speeds fastest;            // at the start, including the velocity that gravity adds
  bool again = false;        // continues from another solve of the same step

  bool is_auto() const { return !simulation.own_method && simulation.method == "auto"; }
  // Without the start, which each solve sets.
  Options options() const;
};

// Work limit (Budget units) of a step with `blocks` contacts and joint rows.
double most_work(std::size_t blocks);

// Solves a VI of the step from x0, the impulses of the last step; empty: zero. `memory` is a solution whose
// arrays are used again.
Solution solve_step(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                    Solution memory = {});
// The same without the islands at rest, whose start is their solution: find_rest() made `start`, of which
// `part` keeps the memory of the solution of the others.
Solution solve_beside(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                      const Rest& rest, Solution start, Solution& part);

}  // namespace amontons
