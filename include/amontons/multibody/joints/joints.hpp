#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/model/state.hpp"
#include "amontons/sets/product.hpp"

namespace amontons {

// The world quantities of one body that the rows of a step need, at the start of the step.
struct BodyFrame {
  Vec3 centre;                    // centre of mass, world, m
  Transform pose;                 // body frame in the world
  Mat3 inertia, inverse_inertia;  // about the centre of mass, world axes (zero inverse if not dynamic)
  double inverse_mass = 0;
  bool stiffened = false;          // inverse_inertia includes the geometric stiffness of joint forces
  Vec3 velocity, omega;            // of the centre of mass, at the start of the step
  Vec3 free_velocity, free_omega;  // with external loads and gravity, without impulses
};

// Which quantity a row of joints is, so that its impulse finds its way back into the state.
enum class RowKind : unsigned char { locked, drive, motor, friction, limit, ball, distance, coupling };
struct RowTag {
  RowKind kind;  // a distance row of one fixed length is locked, `distance` are those of a range
  Index joint;   // or coupling
  Index dof;  // global index of the dof; 0..2 axis of a ball row; -1: limit of a ball, helper of a coupling
  double sign = 1;         // of the coordinate's direction: -1 for an upper limit
  Vec3 force{}, torque{};  // of a locked or distance row or the limit of a ball: the wrench on A of a unit
                           // impulse, axes of frame_b, about the origin of frame_a
  double scale = 1;  // impulse along the coordinate per unit of x; JointOptions::length for an angle, as all
                     // rows are velocities in m/s and all impulses in N s
};

// The impulse of an effort motor, known before the step.
struct KnownImpulse {
  Index dof;
  double impulse;  // N s or N m s
};

// The joint rows of one step: rows of D (bodies' centre-of-mass velocities, world axes), E, c (stabilisation
// and bias: the row asks u = D v+ + E x + c in the normal cone of its set), sets, warm start, and tags.
struct JointRows {
  std::vector<JacobianRow> jacobian;
  std::vector<double> compliance, c, x0;
  SetProduct cones;
  std::vector<RowTag> tags;
  std::vector<KnownImpulse> efforts;  // no rows; only so that store_joint_impulses can report them
  // Auxiliary bodies that couplings of more than two bodies need; they follow the bodies of the model.
  std::vector<double> auxiliary_inverse_mass;
  void clear();
};

struct JointOptions {
  double h;               // s
  double recovery_speed;  // m/s, bound of the speed at which an error of position is taken back
  double length;          // Model::length(), turns angular errors into lengths
};

// Renews state.coordinates from the poses, next to the coordinates there (so that turns are counted). A joint
// whose coordinates are all zero is searched from several starts, and the turn of a single hinge is the one
// within the limits, if any is.
void update_coordinates(const Model& model, const std::vector<BodyFrame>& bodies, State& state);

// Adds the impulses over h of effort motors (world axes, torques about centres of mass) of dynamic bodies.
void add_motor_loads(const Model& model, const std::vector<BodyFrame>& bodies, const State& state, double h,
                     std::vector<Vec3>& impulse_force, std::vector<Vec3>& impulse_torque);

// Appends the rows of every joint, spring, limit, motor, friction and coupling of the model. Joints between
// bodies that are not dynamic have none.
// - Locked directions are taken back within the step, but no faster than recovery_speed (angles times
//   length).
// - Limits have rows only within reach: twice the way of the start or free velocity, or a tenth of length (or
//   0.1 rad).
// - A position motor without gain reaches its target within the step, but moves no more than `length` or a
//   quarter turn, so that turns can be counted and a target that jumps does not fling the bodies; nor is it
//   faster than half of its max_effort can brake. A rigid motor without max_effort stops at the limits.
// - The friction of a ball joint bounds each component of the torque in frame_b: along a diagonal it holds up
//   to sqrt(3) as much.
void append_joint_rows(const Model& model, const std::vector<BodyFrame>& bodies, const State& state,
                       const JointOptions& options, JointRows& rows);

// Stores the impulses x of the rows in the state (wrenches, dof impulses), for reports and warm start; those
// of absent rows become zero.
void store_joint_impulses(const JointRows& rows, std::span<const double> x, State& state);

// The largest violation of locked directions in the present pose: of a position (m), at the anchor of the
// joint's last hinge or the origin of frame_a, and of an angle (rad). Compliant joints are springs and do not
// count.
struct JointError {
  double distance = 0, angle = 0;
};
JointError joint_error(const Model& model, const std::vector<BodyFrame>& bodies, const State& state);

// Energy of all joint springs, J: 1/2 k (q - rest)^2, that of ball joints, and what compliant joints and
// couplings hold. Gains of motors are not springs.
double spring_energy(const Model& model, const std::vector<BodyFrame>& bodies, const State& state);

}  // namespace amontons
