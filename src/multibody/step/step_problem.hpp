#pragma once
#include <memory>
#include <vector>

#include "amontons/multibody/contacts/sleepers.hpp"
#include "amontons/multibody/step/report.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/parts.hpp"
#include "amontons/solvers/driver/solution.hpp"
#include "multibody/step/assemble.hpp"

namespace amontons {

struct Solved;

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

// J: the work of all parts that can only dissipate, and its largest allowed value. The work is taken along
// the mean velocity of the step or, if that exceeds the allowance, along the actual motion.
struct EnergyBalance {
  double work, allowed;
  bool holds() const { return work <= allowed; }
};

// The variational inequality of a step, the result of stage 4.
struct StepProblem {
  JointRows rows;
  Assembly assembly{};
  std::vector<double> x0;  // start of the next solve; empty: zero
  bool again = false;      // x0 is the solution of an earlier solve of the step
  std::shared_ptr<Problem> problem;
  std::vector<Vec3> turns;  // per contact, contained in b; empty: no contact turns
  BodyVelocities
      predicted;  // the free velocities with the impulses x0; unknown without x0, or contacts even asleep
  // The next solve starts from an earlier one of the step.
  void begin_at(const Solved& solved);
};

// Its solution, the result of stages 5 to 7.
struct Solved {
  Solution solution;
  BodyVelocities after;
  EnergyBalance balance{};
  StepPath path = StepPath::accurate;
  StepIslands islands;
};

inline void StepProblem::begin_at(const Solved& solved) {
  x0 = solved.solution.x;
  predicted = solved.after;
  again = true;
}

}  // namespace amontons
