#pragma once
#include <array>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "amontons/base/fields.hpp"
#include "amontons/base/math.hpp"
#include "amontons/problem/contact.hpp"

// Joints, their degrees of freedom and motors, and couplings. Below are the names of their fields, which
// files and other languages use.
namespace amontons {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Drive of a degree of freedom of a joint, in addition to its spring.
enum class MotorKind : unsigned char {
  none,
  // The control is the force or torque itself (N, N m), clipped to max_effort.
  effort,
  // The control is the velocity (m/s, rad/s). With kd > 0 effort = kd (control - q'); otherwise exact.
  velocity,
  // The control is the coordinate (m, rad). With kp > 0 effort = kp (control - q) - kd q'. Otherwise exact
  // within one step, as far as max_effort can accelerate and brake.
  position,
};

// Motors act within the step, as rows of the same problem as contacts. A motor pushes against an obstacle up
// to max_effort, and with a control out of reach it stays at max_effort.
struct Motor {
  MotorKind kind = MotorKind::none;
  double control = 0;            // initial; State::controls hold the present value
  double max_effort = infinity;  // N or N m, > 0
  double kp = 0;                 // of a position motor, N/m or N m/rad
  double kd = 0;                 // of a velocity motor, or a position motor with kp: N s/m or N m s/rad
};

// One degree of freedom of a joint: a hinge about, or a slide along, an axis given in frame_b at zero
// coordinates. The coordinate is the displacement (m) or angle (rad, including full turns) of A relative to
// B.
struct Dof {
  enum class Kind : unsigned char { hinge, slide } kind = Kind::hinge;
  Vec3 axis{0, 0, 1};                          // unit
  Vec3 anchor{};                               // a point on the axis of a hinge, frame_b, m
  double lower = -infinity, upper = infinity;  // limits, m or rad
  double stiffness = 0, rest = 0;              // spring, N/m or N m/rad, coordinate at zero force
  double damping = 0;                          // N s/m or N m s/rad
  double friction = 0;                         // limit of the dry friction force or torque, N or N m
  double friction_static = -1;  // the same if the dof stuck in the last step; negative: `friction`
  double stribeck_speed = 0;    // rate at which it has fallen towards `friction`, m/s or rad/s
  double armature = 0;          // inertia of the drive, kg or kg m^2
  Motor motor{};
  // Limits (N or N m) of the sum of actuator efforts on the dof, direct or by fixed tendons, as far as these
  // efforts are known before the step.
  double lower_effort = -infinity, upper_effort = infinity;
  std::string name{};  // of the coordinate; empty: that of the joint
};

enum class JointKind : unsigned char {
  // B is moved to A by the dofs one after the other (product of exponentials); without dofs the joint is
  // fixed. `spherical`: followed by a free rotation about the origin of frame_a (ball joint).
  chain,
  // The distance of the two frame origins stays within [lower_distance, upper_distance].
  distance,
};

// frame_a, in body A, and frame_b, in body B, coincide at zero coordinates. Positive coordinates move A
// relative to B. The impulses of a joint act on A, and their opposite on B.
struct Joint {
  std::string name;
  JointKind kind = JointKind::chain;
  Index body_a = world, body_b = world;  // A may not be the world
  Transform frame_a, frame_b;
  std::vector<Dof> dofs;  // up to six
  bool spherical = false;
  // For a spherical joint: stiffness and damping towards zero rotation (N m/rad, N m s/rad), dry friction (N
  // m). Then the limit of the rotation angle (rad) and the inertia of the drive (kg m^2).
  double ball_armature = 0;
  double ball_stiffness = 0, ball_damping = 0, ball_friction = 0, ball_limit = infinity;
  double lower_distance = 0, upper_distance = 0;  // m
  double compliance = 0;                          // of the locked directions, m/N; 0: rigid
  bool collide = false;                           // whether the two bodies may touch
  // A condition between bodies that other joints place. Its dofs are never generalised coordinates.
  bool closes_loop = false;
  // Radial clearance (m) of a journal in its bearing, for a chain of two slides and a hinge about their
  // normal; 0: none. With guide_length (m) > 0 the clearance is that of a slider on the first slide, at both
  // of its ends.
  double clearance = 0, guide_length = 0;
  double journal_radius = 0, clearance_friction = 0;  // lever of the friction of a journal, m; mu
  Index link_a = -1, link_b = -1;  // the parts of the bodies that it holds, indices of links; -1: none
};

// coordinate a = polynomial in coordinate b. Each is the coordinate of a dof of a joint or, if a tendon is
// given, its length. Without b (joint_b = tendon_b = -1) only the constant coefficient counts.
struct Coupling {
  std::string name;
  Index joint_a = -1, dof_a = 0, joint_b = -1, dof_b = 0;
  std::vector<double> coefficients;  // ascending powers
  double compliance = 0;
  Index tendon_a = -1, tendon_b = -1;
  double backlash = 0;  // free travel of coordinate a between both flanks, in its unit
};

namespace detail {
AMONTONS_VALUES(MotorKind, none, effort, velocity, position);
AMONTONS_FIELDS(Motor, kind, control, max_effort, kp, kd);
AMONTONS_VALUES(Dof::Kind, hinge, slide);
AMONTONS_FIELDS(Dof, kind, axis, anchor, lower, upper, stiffness, rest, damping, friction, friction_static,
                stribeck_speed, armature, name, lower_effort, upper_effort, motor);
AMONTONS_VALUES(JointKind, chain, distance);
AMONTONS_FIELDS(Joint, name, kind, body_a, body_b, frame_a, frame_b, dofs, spherical, ball_stiffness,
                ball_damping, ball_armature, ball_friction, ball_limit, lower_distance, upper_distance,
                compliance, collide, closes_loop, clearance, guide_length, journal_radius, clearance_friction,
                link_a, link_b);
AMONTONS_FIELDS(Coupling, name, joint_a, dof_a, joint_b, dof_b, coefficients, compliance, tendon_a, tendon_b,
                backlash);
}  // namespace detail

}  // namespace amontons
