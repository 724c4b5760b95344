#pragma once
#include <array>
#include <span>

#include "amontons/multibody/model/model.hpp"
#include "multibody/joints/screw.hpp"

// The geometry of a chain of hinges and slides, in the axes of frame_b. A is moved relative to B by the
// product of exponentials
//   T(q) = exp(s_1 q_1) ... exp(s_k q_k)
// (Brockett 1984; Murray, Li and Sastry, "A Mathematical Introduction to Robotic Manipulation", 1994, ch. 3).
namespace amontons {

struct ChainKinematics {
  std::size_t dofs = 0;
  bool spherical = false;
  Transform target;  // T(q)
  // The point at which velocities are taken and forces act. The last hinge's anchor, so that common joints
  // have pure forces and pure torques; the origin of frame_a of a spherical joint or of one without hinges.
  Vec3 reference;
  std::array<Screw, 6> screws;  // twist of A relative to B per unit rate of each dof, at the reference
  // The small motion that takes T(q) to the present pose: displacement of the reference, rotation vector. The
  // rotation of a spherical joint is not an error but where the joint stands.
  Screw error;
};
// `relative` is frame_a as seen from frame_b, q the coordinates of the joint's dofs.
ChainKinematics chain_kinematics(const Joint& joint, const Transform& relative, std::span<const double> q);

// Whether the joint is a chain: a distance joint of length zero is a ball joint.
bool is_chain(const Joint& joint);

}  // namespace amontons
