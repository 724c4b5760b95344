// What a step passes from one of its calls to the next, kept between steps for its memory only.
#pragma once
#include "amontons/multibody/model/state.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/step/energy.hpp"
#include "multibody/step/lookahead.hpp"
#include "multibody/step/second_order.hpp"

namespace amontons {

// All that the future depends on is in State. Poses (frames) stay as they are at the start of the step;
// velocities at its start, free (with all loads, without impulses) and after it are arrays apart from them.
struct StepScratch {
  State before;
  // When the last substep began, s, and where all bodies stood: the instant of its forces.
  double begun = 0;
  std::vector<Transform> stood;
  BodyFrames frames;
  JointContexts joints;
  JointError joint_error;
  double line_error = 0;      // of couplings and tendons, m
  double last_error = 1e300;  // not tuned: of joints a step before, m
  BodyMobilities mobility, stiffened;
  BodyVelocities start, free, after;
  EnergyScratch energy;
  std::vector<BodyImpulse> loads;
  std::vector<GyroscopicSpin> spins;
  std::vector<JointWrench> impacts;  // of the locked directions of each joint
  std::vector<Mat3> stiffness;
  ContactFinder finder;
  SmoothScratch smooth;
  StepProblem vi;
  bool is_stiffened = false;
  // Time (s) reserved for work after the solve: the longest of the last steps, which decays.
  double reserved = 0;
  // The problem before the last one, where nobody else holds it.
  std::shared_ptr<Problem> spare;
  // One for each kind of problem, as they remember the mechanism: that of steps has all bilateral rows.
  Elimination elimination, position_elimination, impact_elimination;
};

}  // namespace amontons
