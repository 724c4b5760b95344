#pragma once
#include <span>
#include <string>

#include "amontons/base/patience.hpp"
#include "amontons/multibody/step/own_method.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/options.hpp"
#include "multibody/step/light_body_error.hpp"
#include "multibody/step/report_sums.hpp"

namespace amontons {

// The solver of one step: all its solves share method, options and what is left of the budget.
struct StepSolver {
  std::string method;
  Options options;  // but for start and deadline, which each solve has of its own
  StepClock& clock;
  double look;               // s: what finding the contacts took; a method takes about as long to set up
  Elimination& elimination;  // of `auto`: memory, kept from step to step
  Speeds fastest;            // at the start, and what gravity adds
  unsigned& solves;          // calls of a solver, counted for the report
  bool corrected = false;    // positions, in this step
  bool at_rest = false;      // bodies are slow before the step and with its start
  bool again = false;        // goes on from another solve of the same step
  bool missed = false;       // a solve of the same attempt at the step has missed its tolerance
  const StepMethod* own_method = nullptr;  // in the place of `method`, which is its name

  bool is_auto() const { return own_method == nullptr && method == "auto"; }
};

// The work (Patience) that a step of so many contacts and joint rows may do in all: that of first-order
// iterations, whose number grows with the size up to some point.
double most_work(std::size_t blocks);
// One solve of a step takes a share of what is left at most, so that the others have some: those that follow
// from what it found, and the repair of a step that it left unsolved. The share is small where another solve
// has `missed` its tolerance, as so will the step. It has so many seconds, whatever it is made of.
Patience share_of_step(bool missed, double seconds);

// Whether a solution is a start that was accepted.
bool is_accepted_start(const Solution& solution);

// Solves a VI of the step from x0, the impulses of the last step; empty: from nothing. A solution that is no
// longer needed lends its memory.
Solution solve_step(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                    Solution memory = {});

}  // namespace amontons
