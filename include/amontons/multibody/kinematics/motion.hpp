#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/kinematics/spatial.hpp"
#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/model/state.hpp"

namespace amontons {

// Motion of every body of the model.
struct TreeMotion {
  std::vector<Twist> velocities, accelerations;
};

// Poses of the bodies for q.
struct TreePose {
  std::vector<Transform> bodies;  // all of the model; bodies that are not dynamic have the pose in the state
  std::vector<Twist> columns;     // per entry of qd: twist of the supported bodies per unit rate
};

// q and qd of a state, fitted to its poses and velocities. Turns are counted from state.coordinates. The
// quaternion of a ball joint has w >= 0.
struct Coordinates {
  std::vector<double> q, qd;
};
Coordinates read_coordinates(const Tree& tree, const State& state);
// qd of a state whose poses are those of q.
std::vector<double> read_rates(const Tree& tree, const State& state, std::span<const double> q);

// Coordinates of the dofs of all joints that fit the poses of all bodies, next to the given coordinates.
std::vector<double> fitted_coordinates(const Model& model, std::span<const Transform> poses,
                                       std::vector<double> near);

// q after motion with the rates qd for a time h: displacements and angles add, orientations turn.
std::vector<double> moved_along(const Tree& tree, std::span<const double> q, std::span<const double> qd,
                                double h);
// The rates that move the first q to the last in a time 1, with the shortest turns.
std::vector<double> change_along(const Tree& tree, std::span<const double> first,
                                 std::span<const double> last);

// Forward kinematics; quaternions in q are unit quaternions.
TreePose pose_of(const Tree& tree, const State& state, std::span<const double> q);
// Coordinates of the dofs of all joints at q: those of the tree are taken from q, the others are fitted next
// to `near`.
std::vector<double> joint_coordinates_at(const Tree& tree, const TreePose& pose, std::span<const double> q,
                                         std::vector<double> near);
// Velocities of all bodies, and accelerations for the rates qdd of qd. Kinematic bodies keep their velocity.
TreeMotion motion_of(const Tree& tree, const State& state, const TreePose& pose, std::span<const double> qd,
                     std::span<const double> qdd);

// Stores the poses of dynamic bodies in the state, and the coordinates of all joints: those of the tree are
// taken from q, including turns.
void write_poses(const Tree& tree, std::span<const double> q, State& state);
// Stores the velocities of dynamic bodies at q in the state; poses are unchanged.
void write_velocities(const Tree& tree, std::span<const double> q, std::span<const double> qd, State& state);

}  // namespace amontons
