// Position errors are removed by displacing bodies, not by giving them velocities.
#pragma once
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/step/report_sums.hpp"
#include "multibody/trees/tree_motion.hpp"

namespace amontons {

struct PositionInput {
  const Model& model;
  const BodyFrames& frames;
  const BodyMobilities& mobility;  // stiffened: bodies under tension are moved along it, not folded
  const JointContexts& joints;
  const std::vector<Contact>& contacts;
  const BodyVelocities& start;
  const Forest& forest;
  TreeStep& trees;
  JointError error;   // joint errors
  double line_error;  // m, of couplings and tendons
  JointOptions options;
  double speed;  // m/s, limit of the correction
};

// Largest error (m) that is not corrected; angles count times length.
double allowed_error(double length);

// Displaces bodies to remove overlaps and errors of rigid joints and limits, as far as possible and by at
// most speed * h. Velocities of centres of mass stay, and so do angular momenta unless that would create
// energy. Returns whether anything moved.
bool correct_positions(const PositionInput& in, StepClock& clock, Elimination& elimination, State& state,
                       Report& report);

}  // namespace amontons
