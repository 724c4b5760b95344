// The islands of a step, and those at rest, which no solve needs to see.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/contacts/sleepers.hpp"
#include "amontons/solvers/driver/options.hpp"
#include "amontons/solvers/driver/parts.hpp"
#include "multibody/step/observe.hpp"
#include "multibody/step/step_sums.hpp"

namespace amontons {

// An island of the problem and its motion in the step. ContactGraph::islands numbers them.
struct Island {
  double allowed = 0;    // (m/s)^2, sum of the squared speeds of its bodies for an error of 1
  double motion = 0;     // (m/s)^2, this sum for the velocities looked at last
  SquaredMaps start;     // of the start of the solve
  bool rests = false;    // the start is the solution, and the bodies stop
  bool changed = false;  // its impulses are not those of the last step
  bool jumps = false;    // a velocity changes at one instant, after the solve
};

// The islands of a solve. If some rest, the others are a part that is solved apart.
struct StepIslands {
  std::vector<Island> each;  // empty: none has been looked at
  bool any_rests = false;
  bool slow = false;  // all of them rest, and bodies without contacts do not move
  Part moving;
  std::vector<Index> number;  // scratch
  bool all_rest() const { return any_rests && moving.blocks.empty(); }
};

// A problem of the step and its start.
struct PosedStart {
  const Problem& problem;
  const std::vector<double>& x0;
  const BodyVelocities& predicted;  // the free velocities with x0
  bool again;                       // x0 is the solution of an earlier solve of the step
};

// For the impulses of islands that come to rest: options without the start, and where the work is counted.
struct RestSolver {
  Options options;
  Budget& budget;
  StepSums& sums;
};

// Finds the islands at rest for the start x0 of a problem. An island rests if its bodies are slow before the
// step and with the start, and the start is its solution within the tolerance. The start is then accepted,
// and the bodies stop. Otherwise their velocities would stay in the state, later starts would add their
// errors, and the island would never rest. Beside bodies that move, the impulses of an island that rests
// carry its loads to rounding: the balance of momentum stays exact. If any rests, `start` becomes x0 with its
// u.
void find_rest(const StepSetting& step, const Observed& observed, const PosedStart& posed,
               const RestSolver& solver, Solution& start, StepIslands& islands);
// The natural residual of the whole problem, from the maps of the islands that move.
double residual_beside_rest(const StepIslands& islands, SquaredMaps moving);
// Stops the bodies of islands at rest.
void stop_resting(const Model& model, const Islands& graph, const StepIslands& islands, const Subset& visited,
                  BodyVelocities& v);

}  // namespace amontons
