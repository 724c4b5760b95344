#pragma once
#include <memory>
#include <vector>

#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/energy.hpp"
#include "multibody/step/rest.hpp"
#include "multibody/step/second_order.hpp"

namespace amontons {

// The variational inequality of a step, the result of stage 4.
struct StepProblem {
  JointRows rows;
  Assembly assembly{};
  std::vector<double> x0;  // start of the next solve; empty: zero
  bool again = false;      // x0 is the solution of an earlier solve of the step
  std::shared_ptr<Problem> problem;
  std::vector<Vec3> turns;   // per contact, contained in b; empty: no contact turns
  BodyVelocities predicted;  // the free velocities with the impulses x0; empty: nobody has asked yet
  SmoothScratch smooth;
  std::vector<unsigned char> carried;  // per contact: it had an impulse in the last step
};

// Its solution, the result of stages 5 to 7.
struct Solved {
  Solution solution;
  BodyVelocities after;
  EnergyBalance balance{};
  StepPath path = StepPath::accurate;
  EnergyScratch energy;
  Rest rest;      // islands that the solve left out
  Solution part;  // of the others
};

}  // namespace amontons
