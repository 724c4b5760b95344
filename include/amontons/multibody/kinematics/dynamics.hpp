#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/kinematics/motion.hpp"

// The equations of motion of the tree, M(q) qdd + c(q, qd) = tau, with all forces in tau.
namespace amontons {

// For one body: its momentum, and the force that its motion requires besides gravity, that is the rate of the
// momentum minus the weight. Each has its moment about the world's origin as the angular part. The sum over
// bodies is the external force and moment.
struct BodyMomentum {
  Vec3 centre;  // of mass, world
  Twist momentum, force;
};
// The momenta of all bodies of the model. Those that are not dynamic count with the mass in their
// description.
std::vector<BodyMomentum> body_momenta(const Tree& tree, const State& state, const TreePose& pose,
                                       std::span<const double> qd, std::span<const double> qdd);

// Matrices are stored by rows. Forces along qd are in N for displacements and N m for angles.

// 6 x nv: the velocity of a point of a body (world axes), then its angular velocity, per unit of qd.
std::vector<double> point_jacobian(const Tree& tree, const TreePose& pose, Index body, const Vec3& point);

// nv: the rate of a tendon's length per unit of qd.
std::vector<double> tendon_jacobian(const Tree& tree, const State& state, const TreePose& pose,
                                    std::span<const double> q, Index tendon);

// M, nv x nv, with the armatures of dofs and tendons: the composite-rigid-body algorithm (Featherstone, 2008,
// ch. 6).
std::vector<double> mass_matrix(const Tree& tree, const State& state, const TreePose& pose,
                                std::span<const double> q);

// M qdd + c, with gravity in c: the recursive Newton-Euler algorithm (ibid., ch. 5).
std::vector<double> inverse_dynamics(const Tree& tree, const State& state, const TreePose& pose,
                                     std::span<const double> q, std::span<const double> qd,
                                     std::span<const double> qdd);

// The forces along qd of forces at the centres of mass and torques on each body (world axes).
std::vector<double> generalised_forces(const Tree& tree, const TreePose& pose, std::span<const Vec3> forces,
                                       std::span<const Vec3> torques);

}  // namespace amontons
