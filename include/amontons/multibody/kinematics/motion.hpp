#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/model/state.hpp"

namespace amontons {

// The velocity of a body: of the point of it that passes the world's origin, and angular; or the rates of
// both (spatial acceleration: that of a flow at a place, not of a particle). World axes.
//
// About one point twists of all bodies add, which keeps every formula of the tree to a line (Featherstone,
// Rigid Body Dynamics Algorithms, 2008, ch. 2). What cancels far from the origin costs digits in proportion
// to the distance over the size of the model.
struct Twist {
  Vec3 linear, angular;
};

// Of every body of the model.
struct TreeMotion {
  std::vector<Twist> velocities, accelerations;
};

// Where q puts the bodies.
struct TreePose {
  std::vector<Transform> bodies;  // all of the model; those that are not dynamic where the state has them
  std::vector<Twist> columns;     // of each entry of qd: what a unit of it adds to the bodies it supports
};

// q and qd of a state, fitted to its poses and velocities; turns are counted from state.coordinates. The
// quaternion of a ball joint has w >= 0.
struct Coordinates {
  std::vector<double> q, qd;
};
Coordinates read_coordinates(const Tree& tree, const State& state);

// Coordinates of the dofs of all joints that fit the poses of all bodies, next to those given.
std::vector<double> fitted_coordinates(const Model& model, std::span<const Transform> poses,
                                       std::vector<double> near);

// q after moving along the rates qd for a time h: ways and angles add, orientations turn.
std::vector<double> moved_along(const Tree& tree, std::span<const double> q, std::span<const double> qd,
                                double h);

// Forward kinematics; quaternions in q are unit quaternions.
TreePose pose_of(const Tree& tree, const State& state, std::span<const double> q);
// Coordinates of the dofs of all joints at q: those of the tree are q's own, the others fitted next to
// `near`.
std::vector<double> joint_coordinates_at(const Tree& tree, const TreePose& pose, std::span<const double> q,
                                         std::vector<double> near);
// Velocities of all bodies, and accelerations for the rates qdd of qd. Kinematic bodies keep their velocity.
TreeMotion motion_of(const Tree& tree, const State& state, const TreePose& pose, std::span<const double> qd,
                     std::span<const double> qdd);

// Puts the poses of dynamic bodies into the state, and the coordinates of all joints: those of the tree are
// q's own, turns included.
void write_poses(const Tree& tree, std::span<const double> q, State& state);
// Puts the velocities of dynamic bodies at q into the state; poses stay as they are.
void write_velocities(const Tree& tree, std::span<const double> q, std::span<const double> qd, State& state);

// The velocity of a twist at a point of the world.
constexpr Vec3 velocity_at(const Twist& twist, const Vec3& point) {
  return twist.linear + cross(twist.angular, point);
}

}  // namespace amontons
