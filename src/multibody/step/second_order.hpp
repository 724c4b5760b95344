// What rows ask beyond D v+ = 0, so that smooth motion is of second order.
#pragma once
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/problem/problem.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/joints/joint_context.hpp"

namespace amontons {

// The velocities from which a step of length h starts, and how the last one came there.
struct SmoothInput {
  const Model& model;
  const BodyFrames& frames;
  const JointContexts& joints;
  const BodyVelocities& start;
  const std::vector<GyroscopicSpin>& spins;
  const std::vector<Contact>& contacts;
  double h;
};

// Memory of reflect_joints(): velocities before, and of the last step; poses in its middle; bodies that touch
// something, or hang on one that does.
struct SmoothScratch {
  BodyVelocities before, last;
  std::vector<Transform> middle;
  std::vector<unsigned char> touching, near;
};
// Adds to c of the rigid locked rows; the slips in the state become those of the last step.
void reflect_joints(const SmoothInput& in, State& state, JointRows& rows, SmoothScratch& scratch);

// What has been added to b of each contact because it turns, and memory for what is found anew.
struct ContactTurns {
  std::vector<Vec3> added, found;
};
// Adds to b of the contacts that turn as bodies roll, for bodies that move with v, in the place of what was
// added before. Turns below `least` (m/s) are none, nor those that are no size to the free velocities.
// Returns the largest change; one below `least` is none, and b stays as it was.
double turn_contacts(const Reach& reach, const BodyVelocities& free, double least, ContactFinder& finder,
                     ContactTurns& turns, Problem& problem);

}  // namespace amontons
