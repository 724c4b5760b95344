// Arrays that a step passes between its calls; only their memory is kept between steps.
#pragma once
#include "amontons/multibody/model/state.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/step/energy.hpp"
#include "multibody/step/lookahead.hpp"
#include "multibody/step/second_order.hpp"
#include "multibody/trees/tree_motion.hpp"

namespace amontons {

// State contains everything on which the future depends. Poses (frames) stay as they are at the start of the
// step. The velocities are separate arrays: at its start, free (with all loads, without impulses), and after
// it.
struct StepScratch {
  State before;
  // Begin of the last substep (s), and the poses of all bodies there: the instant of its forces.
  double begun = 0;
  std::vector<Transform> stood;
  BodyFrames frames;
  JointContexts joints;
  JointError joint_error;
  double line_error = 0;      // m, of couplings and tendons
  double last_error = 1e300;  // not tuned: m, of joints, one step before
  BodyMobilities mobility, stiffened;
  BodyVelocities start, free, after, predicted;
  EnergyScratch energy;
  std::vector<BodyImpulse> loads;
  std::vector<GyroscopicSpin> spins;
  std::vector<JointWrench> impacts;  // of the locked directions of each joint
  std::vector<Mat3> stiffness;
  ContactFinder finder;
  SmoothScratch smooth;
  StepProblem vi;
  TreeStep trees;
  bool is_stiffened = false;
  // Time (s) reserved for work after the solve: the longest of the last steps, which decays.
  double reserved = 0;
  // The problem before the last one, if only the step holds it.
  std::shared_ptr<Problem> reusable_problem;
  // One for each kind of problem, because each stores the mechanism: that of the step has all bilateral rows.
  Elimination elimination, position_elimination, impact_elimination;
};

}  // namespace amontons
