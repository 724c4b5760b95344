#pragma once
#include <vector>

#include "amontons/multibody/joints/joints.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/step/solve_step.hpp"

namespace amontons {

// Input of impacts: the present bodies (of velocities only the separate `v` is changed), their joints, and
// the solver.
struct ImpactInput {
  const Model& model;
  const State& state;
  const BodyFrames& frames;
  const BodyMobilities& mobility;
  const JointContexts& joints;
  const JointOptions& options;
  double threshold;  // m/s, slower approaches do not bounce
  const StepSolver& solver;
  std::shared_ptr<const ConstrainedBodies> trees = {};  // M without springs and dampers
};

// Impacts with restitution at the start of a step. Changes v from the velocities before the impacts to those
// after. Adds the impulses to the contacts and stores those of the locked directions of each joint, as State
// does. Adds the cost of its solves to the report, and their residual if it is larger. Returns whether
// anything bounced.
bool resolve_impacts(const ImpactInput& in, BodyVelocities& v, std::vector<Contact>& contacts,
                     std::vector<JointWrench>& joints, Report& report);

}  // namespace amontons
