// Terms of rows beyond D v+ = 0 that make smooth motion of second order.
#pragma once
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/problem/problem.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

// The velocities at the start of a step of length h, and data of the last step.
struct SmoothInput {
  const Model& model;
  const BodyFrames& frames;
  const JointContexts& joints;
  const BodyVelocities& start;
  const std::vector<GyroscopicSpin>& spins;
  const std::vector<Contact>& contacts;
  double h;
};

// Scratch of reflect_joints(): velocities before, and of the last step; poses in its middle; bodies that
// touch something or are jointed to such a body.
struct SmoothScratch {
  BodyVelocities before, last;
  std::vector<Transform> middle;
  std::vector<unsigned char> touching, near;
};
// Adds to c of the rigid locked rows. The slips in the state become those of the last step.
void reflect_joints(const SmoothInput& in, State& state, JointRows& rows, SmoothScratch& scratch);

// Terms added to b of each contact because it turns, and scratch.
struct ContactTurns {
  std::vector<Vec3> added, found;
};
// Adds to b of the contacts that turn as bodies roll with velocities v, replacing what was added before.
// Ignores changes below `least` (m/s) and changes far above the free velocities. Returns the largest change;
// if it is below `least`, it is 0 and b is unchanged.
double turn_contacts(const Reach& reach, const BodyVelocities& free, double least, ContactFinder& finder,
                     ContactTurns& turns, Problem& problem);

}  // namespace amontons
