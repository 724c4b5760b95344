#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/contact_system.hpp"
#include "multibody/joints/chain.hpp"

// Where a joint stands in the world, and its rows.
namespace amontons {

// The frames of a joint on its bodies; they coincide only at zero coordinates and without error.
struct JointPose {
  Transform a, b;      // in the world
  Transform relative;  // b^-1 a: frame_a relative to frame_b
};
// At given poses of its bodies.
inline JointPose joint_pose(const Joint& joint, const Transform& body_a, const Transform& body_b) {
  const Transform a = body_a * joint.frame_a, b = body_b * joint.frame_b;
  return {a, b, inverse(b) * a};
}
JointPose joint_pose(const Joint& joint, const BodyFrames& bodies);

// A joint in the world at the present coordinates, ready to make rows. Made once per pose, for all uses
// within a step.
struct JointContext {
  const Joint* joint = nullptr;
  Index index = -1;
  Index body_a = world, body_b = world;  // fixed bodies are replaced by the world: their velocity is zero
  double length = 1;
  Mat3 axes;  // of frame_b in the world
  JointPose pose;
  ChainKinematics chain;
  std::array<Screw, 6> duals;   // dual_wrenches() of the chain
  std::array<Screw, 6> locked;  // locked_wrenches() of the chain, made only by place_joints()
  std::size_t locked_count = 0;
  bool in_tree = false;         // the bodies move in its coordinates: it locks nothing by rows
  Index first_coordinate = -1;  // of the tree: that of its first dof
  Vec3 arm;                     // from the origin of frame_a to the reference point on A, axes of frame_b
  Vec3 r_a, r_b;                // from the centres of mass to the reference point on A, world
  bool rotates(std::size_t dof) const { return joint->dofs[dof].kind == Dof::Kind::hinge; }
  // Rows of angles are multiplied by the length. All rows of a problem then have the same unit, and neither
  // the residual nor the iterates of a solver depend on the units of the model.
  double scale(std::size_t dof) const { return rotates(dof) ? length : 1; }
};
using JointContexts = std::vector<JointContext>;
// `in_tree`, per joint: those of trees; empty if there are none.
void place_joints(const Model& model, const BodyFrames& bodies, const State& state, JointContexts& joints,
                  std::span<const unsigned char> in_tree = {});
// Fills the data that follow from the pose of the joint, the centres of mass and the coordinates.
void place(JointContext& joint, const JointPose& pose, const Vec3& centre_a, const Vec3& centre_b,
           std::span<const double> q);

// The coordinates of the joint's dofs.
std::span<const double> coordinates_of(const Model& model, const State& state, std::size_t joint);
// Whether impulses of the joint can move a body at all.
bool is_active(const Model& model, const Joint& joint);

// The twist of A relative to B at the reference, axes of frame_b. Its product with a wrench is the velocity
// along the wrench's row. Velocities of the world are not read.
Screw joint_twist(const JointContext& joint, const BodyVelocity& a, const BodyVelocity& b);
Screw joint_twist(const JointContext& joint, const BodyVelocities& v);

// The row of a wrench on A (axes of frame_b, about the reference) and the opposite one on B.
JacobianRow joint_row(const JointContext& joint, const Screw& wrench);
// The row of the rate of a dof times its scale.
JacobianRow dof_row(const JointContext& joint, std::size_t dof);
JacobianRow operator*(double s, const JacobianRow& row);

// Adds an impulse along a row to the loads: its wrench on a body, or on both, is that of the unit impulse
// times it.
void add_wrench(const Model& model, Index body, const std::array<double, 6>& j, double impulse,
                std::vector<BodyImpulse>& loads);
void add_wrenches(const Model& model, const JacobianRow& row, double impulse,
                  std::vector<BodyImpulse>& loads);

}  // namespace amontons
