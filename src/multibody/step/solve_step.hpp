#pragma once
#include <span>
#include <string>

#include "amontons/base/patience.hpp"
#include "amontons/solvers/driver/options.hpp"
#include "amontons/solvers/elimination/elimination.hpp"
#include "multibody/step/accounting.hpp"

namespace amontons {

// The solver of one step: all its solves share method, options and what is left of the budget.
struct StepSolver {
  std::string method;
  Options options;  // but for start and deadline, which each solve has of its own
  StepClock& clock;
  Elimination& elimination;  // of `auto`: memory, kept from step to step
  double speed;              // m/s, of the fastest body at the start, and what gravity adds
  bool again = false;        // goes on from another solve of the same step
};

// The work (Patience) that a step of so many contacts and joint rows may do in all: that of first-order
// iterations, whose number grows with the size up to some point. The hardest steps that converge in the
// scenes of this library, of the hopper to 1e-6, take two thirds of it, most less than a hundredth; one that
// is not solved by then has no solution that more work would find.
double most_work(std::size_t blocks);
// One solve of a step takes half of what is left at most, so that the others have some: those that follow
// from what it found, and the repair of a step that it left unsolved.
Patience share_of_step();

// Solves a VI of the step from x0, the impulses of the last step; empty: from nothing. A solution that is no
// longer needed lends its memory.
Solution solve_step(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                    Solution memory = {});

}  // namespace amontons
