// Stage 5 of a step: solves until no unforeseen contact is left.
#pragma once
#include "multibody/step/observe.hpp"
#include "multibody/step/solve_step.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// Solves the problem from its start; the velocities follow.
void solve(const StepSetting& step, const StepSolver& solver, const Observed& observed,
           const StepProblem& posed, Solved& solved);

// Looks ahead along the velocities of a solve. Solves again while this finds contacts that the first search
// could not foresee, which join the problem, or contacts that turn otherwise than predicted.
void look_ahead(const StepSetting& step, const StepSolver& solver, Observed& observed, StepProblem& posed,
                Solved& solved);

// Closes loops of joints in the pose to which the velocities lead, if their island is a system of linear
// equations.
void close_loops(const StepSetting& step, const StepSolver& solver, const State& state, Observed& observed,
                 StepProblem& posed, Solved& solved);

}  // namespace amontons
