#pragma once
#include <memory>
#include <vector>

#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/energy.hpp"
#include "multibody/step/rest.hpp"

namespace amontons {

struct Solved;

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
