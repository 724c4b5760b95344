// Islands at rest, which no solve of a step needs to see.
#pragma once
#include <span>
#include <vector>

#include "amontons/problem/island_part.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"
#include "multibody/step/observe.hpp"

namespace amontons {

// A problem of the step and its start.
struct PosedStart {
  const Problem& problem;
  const std::vector<double>& x0;
  const BodyVelocities& predicted;  // the free velocities with x0; empty: not known
  bool again;                       // x0 is the solution of an earlier solve of the step
};

// Islands at rest, and the problem of the others.
struct Rest {
  bool any = false;
  bool slow = false;                     // all bodies of the scene, those without contacts too
  std::vector<unsigned char> rests;      // per island
  std::vector<double> speed;             // per island: m/s, of an error of 1
  std::vector<std::size_t> moving;       // blocks of the other islands
  IslandPart part;                       // their problem
  std::vector<double> x0;                // its start
  std::vector<double> map, map_at_zero;  // scratch: per island, squared
  std::vector<Index> number;
  BodyVelocities v;  // scratch
  bool all() const { return any && moving.empty(); }
  // Natural residual of the whole problem, from that of the other islands.
  struct Maps {
    double map = 0, at_zero = 0;
  };
  double residual(Maps others) const;
};

// Finds the islands at rest for the start x0 of a problem. An island rests if its bodies are slow before the
// step and with the start, and the start is its solution. The start is then accepted, and the bodies stop.
// Otherwise their velocities would stay in the state, later starts would add their errors, and the island
// would never rest. If all that the scene has is slow and solved within the tolerance, all of it rests.
// Beside bodies that move, an island rests if its start is a solution to rounding: the balance of momentum
// stays exact. If any rests, `start` becomes x0 with its u.
//
void find_rest(const StepSetting& step, const Observed& observed, const PosedStart& posed, Solution& start,
               Rest& rest);
// Stops the bodies of islands at rest.
void stop_resting(const Model& model, const Islands& islands, const Rest& rest, BodyVelocities& v);

}  // namespace amontons
