#pragma once
#include <cmath>
#include <vector>

#include "amontons/base/parts.hpp"
#include "amontons/multibody/model/model.hpp"

namespace amontons {

// The impulses of one joint in the last step: the wrench of its locked directions on A about the origin of
// frame_a, in the axes of frame_b.
struct JointWrench {
  Vec3 force, torque;  // N s, N m s
};
// A twist of A relative to B in the locked directions of a joint, at its reference point, axes of frame_b.
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

// The impulses of a tendon along its length.
struct TendonImpulse {
  double passive = 0;  // damper, armature, and a spring with one rest length
  double spring = 0;   // a spring with a range of rest lengths
  double friction = 0;
  double limit = 0;  // > 0 pushes away from the lower limit
};

// A contact with an impulse in the last step, as far as the next one reads it: a record of a contact is five
// times as large.
struct CarriedContact {
  Index geom_a = -1, geom_b = -1;
  Vec3 local;                     // the point in the frame of body A
  Vec3 impulse, angular_impulse;  // without impacts: N s, and N m s about the point
  double slip = 0;                // m/s; 0: it stuck
};

// Velocities of a body in the middle of the last step, with which the next one begins, and those that the
// last step left in the state. They are of the origin of its frame, as in the state.
struct MiddleVelocity {
  Vec3 linear, angular;            // world, m/s, rad/s
  Vec3 left_linear, left_angular;  // other ones in the state were set by the user
};

// Largest |coordinate| of a position (m), speed (m/s, rad/s), force and so on in a state. It is far beyond
// any mechanism in any units, and far below values whose squares and products overflow.
inline constexpr double largest_coordinate = 1e15;
// Largest |force|, |torque|, |control| and joint force in a state.
inline constexpr double largest_load = 1e30;
// The comparison is written so that a NaN fails it.
inline bool within(const Vec3& a, double most) {
  return std::abs(a.x) <= most && std::abs(a.y) <= most && std::abs(a.z) <= most;
}

// The data that a simulation changes. It is complete: a saved state continues bit for bit. Coordinates belong
// to it because poses determine them only up to full turns. Impulses belong to it because a solve starts from
// them, and because stiffening uses the joints' forces.
struct State {
  double time = 0;  // s
  std::uint64_t steps = 0;
  double impulse_step = 0;               // s, the time over which the impulses below acted; 0: none yet
  double last_step = 0;                  // s, the last step that a next one continues; 0: none
  std::vector<Vec3> positions;           // of the origin of each body frame, world, m
  std::vector<Quat> orientations;        // body axes into world axes
  std::vector<Vec3> linear_velocities;   // of the origin of each body frame, world, m/s
  std::vector<Vec3> angular_velocities;  // world, rad/s
  std::vector<MiddleVelocity> middle_velocities;
  std::vector<Vec3> forces, torques;  // constant external loads at each centre of mass, world, N, N m
  // Arrays with one entry per dof are indexed by Model::first_dof().
  std::vector<double> coordinates;  // per dof, m or rad, including full turns
  // Controls in the order of Model::controls(): of every actuator, then of every motor.
  std::vector<double> controls;
  // Constant generalised forces along qd, in the order of Tree: N or N m. Empty means zero; a Simulation has
  // all.
  std::vector<double> joint_forces;
  // The four kinds of loads above as they were held over the last step.
  std::vector<Vec3> held_forces, held_torques;
  std::vector<double> held_controls, held_joint_forces;
  // Per actuator: activation (ignored without dynamics), impulse of the effort along its length.
  std::vector<double> activations, actuator_impulses;
  // Contacts with an impulse in the last step, sorted by (geom_a, geom_b).
  std::vector<CarriedContact> contacts;
  std::vector<JointWrench> joint_wrenches;
  std::vector<JointSlip> joint_slips;  // in the middle of the step before the last, see step/second_order
  std::vector<DofImpulse> dof_impulses;
  std::vector<Vec3> ball_impulses;  // per joint: spring, damper, friction of spherical joints, N m s
  std::vector<double> coupling_impulses;
  std::vector<TendonImpulse> tendon_impulses;
  // Per dof: its rate after the last step if dry friction slipped, 0 if it stuck. Empty without a dof whose
  // static friction differs.
  std::vector<double> dof_slips;
  // Two per place at which a tendon rubs, in the order of the tendons: half the sum and half the
  // difference of the tensions' impulses before and after it.
  std::vector<double> rub_impulses;
  // Per bond: the largest distance (m) that its two points have had after a step. It is broken, for good,
  // once this exceeds Bond::opening.
  std::vector<double> bond_openings;
};

// The pose of a body; that of the world is the identity.
inline Transform pose_in(const State& state, Index body) {
  return body < 0 ? Transform{} : Transform{state.positions[body], state.orientations[body]};
}

// Throws InputError naming the body whose position, orientation or velocity is not finite, or whose
// orientation is not a unit quaternion within 1e-6. It looks at the bodies of `changed` and at all controls.
void validate(const Model& model, const State& state, const Subset& changed = {});

}  // namespace amontons
