#pragma once
#include <cmath>
#include <vector>

#include "amontons/multibody/model/model.hpp"

namespace amontons {

// The impulses of one joint in the last step: the wrench on A of its locked directions about the origin of
// frame_a, in the axes of frame_b.
struct JointWrench {
  Vec3 force, torque;  // N s, N m s
};
// A twist of A relative to B in the locked directions of a joint, at its reference, axes of frame_b.
struct JointSlip {
  Vec3 linear, angular;  // m/s, rad/s
};
// The impulses of one degree of freedom along its coordinate, N s or N m s.
struct DofImpulse {
  double passive = 0;  // spring, damper and armature
  double motor = 0;
  double friction = 0;
  double limit = 0;  // > 0 pushes away from the lower limit
};

// The impulses along a tendon's length.
struct TendonImpulse {
  double passive = 0;  // damper and armature, and the spring if it has one rest length
  double spring = 0;   // one with a range of rest lengths
  double friction = 0;
  double limit = 0;  // > 0 pushes away from the lower limit
};

// What a state may hold: |coordinate| of a position (m) and speed (m/s, rad/s); |force| and the like. Far
// beyond any mechanism in any units, and far from where squares and products overflow.
inline constexpr double largest_coordinate = 1e15;
inline constexpr double largest_load = 1e30;
// The comparison is written so that a NaN fails it.
inline bool within(const Vec3& a, double most) {
  return std::abs(a.x) <= most && std::abs(a.y) <= most && std::abs(a.z) <= most;
}

// What a simulation changes, and all that it needs to go on bit for bit: a saved state continues as if it had
// never stopped. Coordinates are part of it because poses tell them but for full turns; impulses because a
// solve starts from them, and because stiffening takes the joints' forces from them.
struct State {
  double time = 0;  // s
  std::uint64_t steps = 0;
  double impulse_step = 0;               // s, the time step that the impulses below belong to; 0: none yet
  std::vector<Vec3> positions;           // of the origin of each body frame, world, m
  std::vector<Quat> orientations;        // body axes into world axes
  std::vector<Vec3> linear_velocities;   // of the origin of each body frame, world, m/s
  std::vector<Vec3> angular_velocities;  // world, rad/s
  std::vector<Vec3> forces, torques;     // held external loads at each centre of mass, world, N, N m
  // Arrays of one entry per dof go by Model::first_dof().
  std::vector<double> coordinates;  // of every dof, m or rad, turns counted
  // Controls in the order of Model::controls(): of every actuator, then of every motor.
  std::vector<double> controls;
  // Held generalised forces along qd, in the order of Tree: N or N m. Empty is none; a Simulation has all.
  std::vector<double> joint_forces;
  // Activation (not read without dynamics) and effort impulse along its length of every actuator.
  std::vector<double> activations, actuator_impulses;
  // Contacts that carried something in the last step, without impacts, sorted by (geom_a, geom_b): of them
  // the next step reads geoms, `local` and the impulses.
  std::vector<Contact> contacts;
  std::vector<JointWrench> joint_wrenches;
  std::vector<JointSlip> joint_slips;  // in the middle of the step before the last, see step/second_order
  std::vector<DofImpulse> dof_impulses;
  std::vector<Vec3> ball_impulses;  // per joint: spring, damper, friction of spherical joints, N m s
  std::vector<double> coupling_impulses;
  std::vector<TendonImpulse> tendon_impulses;
};

// Throws InputError naming the body whose position, orientation or velocity is not finite, or whose
// orientation is not a unit quaternion within 1e-6.
void validate(const Model& model, const State& state);

}  // namespace amontons
