#pragma once
#include <array>
#include <span>

#include "amontons/multibody/model/model.hpp"

// The geometry of a chain of hinges and slides, in the axes of frame_b. A is moved relative to B by the
// product of exponentials
//   T(q) = exp(s_1 q_1) ... exp(s_k q_k)
// (Brockett 1984; Murray, Li and Sastry, "A Mathematical Introduction to Robotic Manipulation", 1994, ch. 3).
// It gives the twists of the dofs, the wrenches along them, and the wrenches that the joint locks. No kind of
// joint has a geometry of its own.
namespace amontons {

// A twist (velocity of a point, angular velocity) or a wrench (force, torque about that point). The product
// of a wrench and a twist is power.
struct Screw {
  Vec3 linear, angular;
};
constexpr double dot(const Screw& a, const Screw& b) {
  return dot(a.linear, b.linear) + dot(a.angular, b.angular);
}
constexpr Screw operator*(double s, const Screw& a) { return {s * a.linear, s * a.angular}; }

struct ChainKinematics {
  std::size_t dofs = 0;
  bool spherical = false;
  Transform target;  // T(q)
  // The point of velocities and forces. It is the last hinge's anchor, so that common joints have pure forces
  // and pure torques. For a spherical joint or one without hinges it is the origin of frame_a.
  Vec3 reference;
  std::array<Screw, 6> screws;  // twist of A relative to B per unit rate of each dof, at the reference
  // The small motion that takes T(q) to the present pose: displacement of the reference, rotation vector. For
  // a spherical joint the rotation is not an error but its orientation.
  Screw error;
};
// `relative` is frame_a relative to frame_b, q the coordinates of the joint's dofs.
ChainKinematics chain_kinematics(const Joint& joint, const Transform& relative, std::span<const double> q);

// Whether the joint is a single hinge, as most are: its axis and anchor are fixed in B for every q.
inline bool is_hinge(const Joint& joint) {
  return joint.kind == JointKind::chain && !joint.spherical && joint.dofs.size() == 1 &&
         joint.dofs[0].kind == Dof::Kind::hinge;
}

// Whether the joint is a chain: a distance joint of length zero is a ball joint.
bool is_chain(const Joint& joint);

// Below, `length` makes angles comparable with displacements. The norm of twists is <v, v> / length^2 + <w,
// w>, that of wrenches <f, f> + <t, t> / length^2.

// Dual wrenches: rate of dof i = <dual_i, twist>, the least-squares solution of sum_i screws_i q'_i = twist.
// The generalised force tau of dof i is the wrench tau dual_i on A. For a spherical joint, forces only.
std::array<Screw, 6> dual_wrenches(const ChainKinematics& chain, double length);

// Wrenches at the reference that do no work on the dofs, torques times `length`: an orthonormal basis with
// respect to <f, f> + <t, t> / length^2. Returns their number: 6 (or 3 if spherical) minus the dofs.
std::size_t locked_wrenches(const ChainKinematics& chain, double length, std::array<Screw, 6>& wrenches);

}  // namespace amontons
