// Errors of position are taken back by moving bodies, not by giving them velocities.
#pragma once
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/step/report_sums.hpp"

namespace amontons {

struct PositionInput {
  const Model& model;
  const BodyFrames& frames;
  const BodyMobilities& mobility;  // stiffened: what is under tension is moved along it, not folded
  const JointContexts& joints;
  const std::vector<Contact>& contacts;
  JointError error;   // of the joints
  double line_error;  // of couplings and tendons, m
  JointOptions options;
  double speed;  // m/s, at which errors are taken back at most
};

// The largest error, m, angles times length, that stays as it is.
double allowed_error(double length);

// Moves bodies so that overlaps and errors of rigid joints and limits vanish, as far as they can, and no
// further than speed * h. Velocities of centres of mass stay, and so do angular momenta where that gives
// no energy. Returns whether anything moved.
bool correct_positions(const PositionInput& in, StepClock& clock, Elimination& elimination, State& state,
                       Report& report);

}  // namespace amontons
