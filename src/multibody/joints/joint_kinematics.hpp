#pragma once
#include <array>
#include <span>

#include "amontons/multibody/joints/joints.hpp"

// The geometry of a joint, in the axes of frame_b. A is moved relative to B by the product of exponentials
//   T(q) = exp(s_1 q_1) ... exp(s_k q_k)
// (Brockett 1984; Murray, Li and Sastry, "A Mathematical Introduction to Robotic Manipulation", 1994, ch. 3).
// All functions take the length that makes angles comparable with displacements.
namespace amontons {

// A twist (velocity of a point, angular velocity) or a wrench (force, torque about a point).
struct Screw {
  Vec3 linear, angular;
};
constexpr double dot(const Screw& a, const Screw& b) {
  return dot(a.linear, b.linear) + dot(a.angular, b.angular);
}
constexpr Screw operator*(double s, const Screw& a) { return {s * a.linear, s * a.angular}; }

// frame_a as seen from frame_b.
struct JointPose {
  Transform a, b;      // the frames in the world
  Transform relative;  // b^-1 a
};
JointPose joint_pose(const Joint& joint, const std::vector<BodyFrame>& bodies);

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
ChainKinematics chain_kinematics(const Joint& joint, const Transform& relative, std::span<const double> q);

// Dual wrenches: rate of dof i = <dual_i, twist>, the least-squares solution of sum_i screws_i q'_i = twist.
// The generalised force tau of dof i is the wrench tau dual_i on A. Of a spherical joint, forces only.
std::array<Screw, 6> dual_wrenches(const ChainKinematics& chain, double length);

// Wrenches at the reference that do no work on the dofs, torques times `length`: an orthonormal basis w.r.t.
// <f, f> + <t, t> / length^2. Returns their number: 6 (or 3 if spherical) less the dofs.
std::size_t locked_wrenches(const ChainKinematics& chain, double length, std::array<Screw, 6>& wrenches);

// A joint in the world at the present coordinates, ready to make rows. The fixed bodies have become the
// world.
struct JointContext {
  const Joint* joint = nullptr;
  Index index = -1;
  Index body_a = world, body_b = world;
  double length = 1;
  Mat3 axes;  // of frame_b in the world
  JointPose pose;
  ChainKinematics chain;
  std::array<Screw, 6> duals;
  Vec3 arm;       // from the origin of frame_a to the reference point on A, axes of frame_b
  Vec3 r_a, r_b;  // from the centres of mass to the reference point on A, world
  bool rotates(std::size_t dof) const { return joint->dofs[dof].kind == Dof::Kind::hinge; }
  // Rows of angles are multiplied by the length: then all rows of a problem have the same unit, and neither
  // the residual nor the iterates of a solver depend on the units of the model.
  double scale(std::size_t dof) const { return rotates(dof) ? length : 1; }
};
// A distance joint of length zero is a ball joint.
bool is_chain(const Joint& joint);
// Whether the joint can move a body at all.
bool is_active(const Model& model, const Joint& joint);
JointContext joint_context(const Model& model, const std::vector<BodyFrame>& bodies, const State& state,
                           std::size_t joint);

// The wrench on A, the opposite one on B at the same point of the world: momentum is conserved to rounding.
JacobianRow joint_row(const JointContext& joint, const Screw& wrench);
JacobianRow operator*(double s, const JacobianRow& row);
// D M^-1 D' of one row; the velocity of the row at the start of the step, and without impulses.
double inverse_effective_mass(const std::vector<BodyFrame>& bodies, const JacobianRow& row);
double start_velocity(const std::vector<BodyFrame>& bodies, const JacobianRow& row);
double free_velocity(const std::vector<BodyFrame>& bodies, const JacobianRow& row);
// The rates that the last step ended with, for the inertia of drives: those of the start velocities on the
// Jacobian of that step. On the present one they differ by h J' v, which over many steps is not small (q'' =
// J v' + J' v) where the axes of one joint turn with its other degrees of freedom.
std::array<double, 6> rates_before(const JointContext& joint, const std::vector<BodyFrame>& bodies,
                                   std::span<const double> q, double h);

// Locked rows that repeat each other (the two hinges of a door, planar loops) make A singular, and nothing
// then decides how they share the load. This compliance, relative to D M^-1 D' of the row, makes them share
// it evenly. Not larger: a row sags by this fraction of g h^2 (times the mass that it carries over its own),
// 2e-11 m for a body on one joint. Not smaller: positions are known to 1e-16 of their size, and that
// rounding, over h and over this compliance, is a load that redundant rows put on each other, below 1e-4 of
// the weight.
constexpr double locked_regularisation = 1e-7;

// Row makers, in the order in which a joint's rows stand.
void append_row(JointRows& rows, const JacobianRow& row, double compliance, double c, double x0,
                const RowTag& tag);
void append_locked_rows(const JointContext& joint, const std::vector<BodyFrame>& bodies, const State& state,
                        const JointOptions& options, JointRows& rows);
void append_dof_rows(const Model& model, const JointContext& joint, const std::vector<BodyFrame>& bodies,
                     const State& state, const JointOptions& options, JointRows& rows);
void append_ball_rows(const JointContext& joint, const std::vector<BodyFrame>& bodies, const State& state,
                      const JointOptions& options, JointRows& rows);
void append_distance_rows(const JointContext& joint, const std::vector<BodyFrame>& bodies, const State& state,
                          const JointOptions& options, JointRows& rows);
void append_coupling_rows(const Model& model, const std::vector<BodyFrame>& bodies, const State& state,
                          const JointOptions& options, JointRows& rows);

// coordinate_a - polynomial(coordinate_b), and the polynomial's slope.
struct CouplingValue {
  double violation, slope;
};
CouplingValue coupling_value(const Model& model, const Coupling& coupling, const State& state);

}  // namespace amontons
