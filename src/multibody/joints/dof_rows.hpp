#pragma once
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/row_terms.hpp"

namespace amontons {

// A body at the start of the last step, and the velocity of the solve that brought it here.
struct Past {
  Transform pose;
  Vec3 centre;
  BodyVelocity velocity;
};
Past past(const BodyFrame& body, const BodyVelocity& v, double h);

// The rates of a joint's coordinates q that the last step ended with, for the inertia of drives.
std::array<double, 6> rates_before(const JointContext& now, const StepBodies& bodies,
                                   std::span<const double> q, double h);

// Along each degree of freedom of a chain: the drive (spring, damper and armature), motor, actuators, dry
// friction and limits.
void append_dof_rows(const RowInput& in, const JointContext& joint, JointRows& rows);

}  // namespace amontons
