#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "amontons/multibody/model/joint_parts.hpp"

// Tendons and actuators, and the names of their fields.
namespace amontons {

// One joint coordinate in a fixed tendon.
struct TendonTerm {
  Index joint = -1, dof = 0;
  double coefficient = 1;
};

// One element of the path of a spatial tendon.
struct PathElement {
  enum class Kind : unsigned char {
    point,     // the tendon passes through the origin of the frame
    sphere,    // obstacle about the origin of the frame: the tendon goes around or through it
    cylinder,  // the same, about the frame's third axis and without ends
    pulley,    // the tendon restarts at the next point; from here on lengths count 1 / divisor
  } kind = Kind::point;
  Index body = world;
  Transform frame;    // in the body frame
  double radius = 0;  // of an obstacle, m
  // For an obstacle: a point of side_body, in its frame (m); the tendon passes on its side. If the point is
  // inside the obstacle, the tendon passes through. By default the tendon takes the shorter path around.
  std::optional<Vec3> side;
  Index side_body = world;
  double divisor = 1;   // for a pulley
  double friction = 0;  // Coulomb's mu of the tendon on a point or an obstacle
  double turns = 0;     // full turns around a cylinder besides the shortest path
};

// A length that several joints or bodies change, with forces along it. A `fixed` tendon is a linear
// combination of joint coordinates and has their unit; a spatial one is the length of a path. A positive
// effort works along a growing length, so a pulling tendon has a negative effort.
struct Tendon {
  std::string name;
  std::vector<TendonTerm> terms;               // for a fixed tendon
  std::vector<PathElement> path;               // for a spatial one
  double lower = -infinity, upper = infinity;  // limits of the length, m or unit of the terms
  // A spring, without force between the two rest lengths, N/m (N m/rad).
  double stiffness = 0, rest_lower = 0, rest_upper = 0;
  double damping = 0, friction = 0, armature = 0;  // as in Dof
  bool closed = false;                             // a belt around the two parallel cylinders of its path
};

// The length l (m or rad) that an actuator acts along; the bodies' velocities determine its rate. A unit
// effort of the actuator does one unit of work per unit of l.
struct Transmission {
  enum class Kind : unsigned char {
    dof,     // l = gear q
    tendon,  // l = gear times the tendon's length
    // A wrench `force`, `torque` per unit of effort, at the origin of `frame` on the body; the opposite acts
    // on the reference body. In the axes of the reference frame, l = <force, p> + <torque, r>, with the
    // position p and the rotation vector r of frame relative to it. In the frame's own axes (a thruster; the
    // reference body only takes the reaction) the force has no length: l = <torque, r>.
    wrench,
    // A rod of length `rod` joins the origin of `frame` (the crank) to a slider on the third axis of the
    // reference frame. l is gear times the position of the slider on that axis.
    slider_crank,
  } kind = Kind::dof;
  Index joint = -1, dof = 0, tendon = -1;
  Index body = world, reference_body = world;
  Transform frame, reference;  // in these bodies
  Vec3 force, torque;
  bool own_axes = false;
  double rod = 0;
  double gear = 1;
};

// Dynamics of the activation w of an actuator with control u.
enum class ActivationKind : unsigned char {
  none,        // w = u
  integrator,  // w' = u
  filter,      // w' = (u - w) / time_constant
};

// An effort that is affine in control, length and rate:
//   effort = clip(gain_0 w + gain_1 w l + gain_2 w l' + bias_0 + bias_1 l + bias_2 l', force limits).
// The restoring part (coefficients of l and l' that are not positive) acts within the step, as a row of the
// problem. The rest takes its values at the start of the step.
struct Actuator {
  std::string name;
  Transmission transmission;
  std::array<double, 3> gain{1, 0, 0}, bias{0, 0, 0};
  double lower_force = -infinity, upper_force = infinity;  // N or N m
  double control = 0;                                      // initial
  double lower_control = -infinity, upper_control = infinity;
  ActivationKind dynamics = ActivationKind::none;
  double time_constant = 0;  // of a filter, s; 0: no delay
  double activation = 0;     // initial
  double lower_activation = -infinity, upper_activation = infinity;
  bool early = false;  // the effort uses the activation at the end of the step
};

namespace detail {
AMONTONS_FIELDS(TendonTerm, joint, dof, coefficient);
AMONTONS_VALUES(PathElement::Kind, point, sphere, cylinder, pulley);
AMONTONS_FIELDS(PathElement, kind, body, frame, radius, side, side_body, divisor, friction, turns);
AMONTONS_FIELDS(Tendon, name, terms, path, lower, upper, stiffness, rest_lower, rest_upper, damping, friction,
                armature, closed);
AMONTONS_VALUES(Transmission::Kind, dof, tendon, wrench, slider_crank);
AMONTONS_FIELDS(Transmission, kind, joint, dof, tendon, body, reference_body, frame, reference, force, torque,
                own_axes, rod, gear);
AMONTONS_VALUES(ActivationKind, none, integrator, filter);
AMONTONS_FIELDS(Actuator, name, transmission, gain, bias, lower_force, upper_force, control, lower_control,
                upper_control, dynamics, time_constant, activation, lower_activation, upper_activation,
                early);
}  // namespace detail

}  // namespace amontons
