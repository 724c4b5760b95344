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
template <>
inline constexpr auto values_of<MotorKind> =
    std::array{Named{"none", MotorKind::none}, Named{"effort", MotorKind::effort},
               Named{"velocity", MotorKind::velocity}, Named{"position", MotorKind::position}};
template <>
inline constexpr auto fields<Motor> =
    std::tuple(Field{"kind", &Motor::kind}, Field{"control", &Motor::control},
               Field{"max_effort", &Motor::max_effort}, Field{"kp", &Motor::kp}, Field{"kd", &Motor::kd});
template <>
inline constexpr auto values_of<Dof::Kind> =
    std::array{Named{"hinge", Dof::Kind::hinge}, Named{"slide", Dof::Kind::slide}};
template <>
inline constexpr auto fields<Dof> = std::tuple(
    Field{"kind", &Dof::kind}, Field{"axis", &Dof::axis}, Field{"anchor", &Dof::anchor},
    Field{"lower", &Dof::lower}, Field{"upper", &Dof::upper}, Field{"stiffness", &Dof::stiffness},
    Field{"rest", &Dof::rest}, Field{"damping", &Dof::damping}, Field{"friction", &Dof::friction},
    Field{"friction_static", &Dof::friction_static}, Field{"stribeck_speed", &Dof::stribeck_speed},
    Field{"armature", &Dof::armature}, Field{"name", &Dof::name}, Field{"lower_effort", &Dof::lower_effort},
    Field{"upper_effort", &Dof::upper_effort}, Field{"motor", &Dof::motor});
template <>
inline constexpr auto values_of<JointKind> =
    std::array{Named{"chain", JointKind::chain}, Named{"distance", JointKind::distance}};
template <>
inline constexpr auto fields<Joint> = std::tuple(
    Field{"name", &Joint::name}, Field{"kind", &Joint::kind}, Field{"body_a", &Joint::body_a},
    Field{"body_b", &Joint::body_b}, Field{"frame_a", &Joint::frame_a}, Field{"frame_b", &Joint::frame_b},
    Field{"dofs", &Joint::dofs}, Field{"spherical", &Joint::spherical},
    Field{"ball_stiffness", &Joint::ball_stiffness}, Field{"ball_damping", &Joint::ball_damping},
    Field{"ball_armature", &Joint::ball_armature}, Field{"ball_friction", &Joint::ball_friction},
    Field{"ball_limit", &Joint::ball_limit}, Field{"lower_distance", &Joint::lower_distance},
    Field{"upper_distance", &Joint::upper_distance}, Field{"compliance", &Joint::compliance},
    Field{"collide", &Joint::collide}, Field{"closes_loop", &Joint::closes_loop},
    Field{"clearance", &Joint::clearance}, Field{"guide_length", &Joint::guide_length},
    Field{"journal_radius", &Joint::journal_radius}, Field{"clearance_friction", &Joint::clearance_friction},
    Field{"link_a", &Joint::link_a}, Field{"link_b", &Joint::link_b});
template <>
inline constexpr auto fields<Coupling> =
    std::tuple(Field{"name", &Coupling::name}, Field{"joint_a", &Coupling::joint_a},
               Field{"dof_a", &Coupling::dof_a}, Field{"joint_b", &Coupling::joint_b},
               Field{"dof_b", &Coupling::dof_b}, Field{"coefficients", &Coupling::coefficients},
               Field{"compliance", &Coupling::compliance}, Field{"tendon_a", &Coupling::tendon_a},
               Field{"tendon_b", &Coupling::tendon_b}, Field{"backlash", &Coupling::backlash});
}  // namespace detail

}  // namespace amontons
