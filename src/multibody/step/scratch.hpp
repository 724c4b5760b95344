#pragma once
#include <memory>

#include "amontons/multibody/joints/rows.hpp"
#include "amontons/problem/problem.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/parts.hpp"
#include "multibody/step/observe.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

// Rows and problem of a correction: their memory is kept between steps. A large pile needs a correction in
// most steps, with a row per contact.
struct PositionMemory {
  JointRows joints, rows;
  Problem problem;
  Part part;  // of it: the islands that are corrected
  std::vector<Index> number;
  Elimination elimination;
};

// The values that the stages of a step pass on. Each stage fills its own; only their memory is kept between
// steps, and no result depends on it.
struct StepScratch {
  Observed observed;
  StepProblem posed;
  Solved solved;
  Stiffened stiffened;
  StepMemory memory;
  ContactFinder finder;
  PositionMemory positions;
  // Each kind of problem has an own one, because it stores the mechanism: that of the step has all bilateral
  // rows.
  Elimination elimination, impact_elimination, loop_elimination;
};

}  // namespace amontons
