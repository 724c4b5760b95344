#pragma once
#include <span>
#include <string>

#include "amontons/solvers/elimination/elimination.hpp"
#include "multibody/step/accounting.hpp"

namespace amontons {

// The solver of one step: all its solves share method, options and what is left of the budget.
struct StepSolver {
  std::string method;
  Options options;  // but for start and deadline, which each solve has of its own
  StepClock& clock;
  Elimination& elimination;  // of `auto`: memory, kept from step to step
};

// Solves a VI of the step from x0, the impulses of the last step; empty: from nothing. A solution that is no
// longer needed lends its memory.
Solution solve_step(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                    Solution memory = {});

}  // namespace amontons
