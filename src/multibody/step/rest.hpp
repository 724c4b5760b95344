// The islands of a step, and those at rest, which no solve needs to see.
#pragma once
#include "multibody/step/observe.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

struct StepSolver;

// Finds the islands at rest for the start x0 of a problem. An island rests if its bodies are slow before the
// step and with the start, and the start is its solution within the tolerance. The start is then accepted,
// and the bodies stop. Otherwise their velocities would stay in the state, later starts would add their
// errors, and the island would never rest. Beside bodies that move, the impulses of an island that rests
// carry its loads to rounding: the balance of momentum stays exact. If any rests, `start` becomes x0 with its
// u.
void find_rest(const StepSetting& step, const Observed& observed, const StepProblem& posed,
               const StepSolver& solver, Solution& start, StepIslands& islands);
// Stops the bodies of islands at rest.
void stop_resting(const Model& model, const Islands& graph, const StepIslands& islands, const Subset& visited,
                  BodyVelocities& v);

}  // namespace amontons
