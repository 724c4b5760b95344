#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "amontons/collision/shapes/shapes.hpp"
#include "amontons/problem/contact.hpp"

// What users describe. SI units; `world` (-1) as a body index is the inertial frame.
namespace amontons {

constexpr double infinity = std::numeric_limits<double>::infinity();

// How a body gets its velocity.
enum class Motion : unsigned char {
  dynamic,    // moved by forces and impulses
  kinematic,  // moves with the velocity that the state holds; forces do not change it
  fixed,      // does not move
};

// A rigid body: a frame that its geoms and joints hang on, and how heavy it is.
struct Body {
  std::string name;
  Motion motion = Motion::dynamic;
  // Of a body that is not dynamic neither is read.
  double mass = 0;                         // kg, > 0 if dynamic
  Vec3 centre_of_mass;                     // in the body frame, m
  Mat3 inertia;                            // about the centre of mass, body axes, kg m^2
  double gravity_scale = 1;                // its weight over mass times gravity; 0 floats
  Transform pose;                          // initial, body frame in the world
  Vec3 linear_velocity, angular_velocity;  // initial, of the frame's origin, world axes, m/s, rad/s
};

// How the materials of two geoms give those of their contact. Restitution is always the larger one,
// compliances add (springs in series; each relaxes at its own rate, and the pair at the mean by compliance),
// rest offsets add, and of torsional and rolling friction the larger one counts: they are
// often given for one of the two only.
enum class FrictionRule : unsigned char { geometric_mean, maximum, minimum, mean };

// A shape on a body, with what its surface is made of. A body may have any number of geoms, also none; its
// mass and inertia are its own and do not follow from them.
struct Geom {
  std::string name;
  Index body = world;
  Transform frame;  // of the shape in the body frame
  Shape shape = Sphere{1};
  Material material;
  Vec3 surface_velocity;  // of the surface relative to the body, body frame, m/s (conveyors, tracks)
  Vec3 surface_spin;  // its rotation about the origin of the geom, body frame, rad/s (turntables, rollers)
  // Along which material.friction is, body frame; zero only without friction_across.
  Vec3 friction_direction;
  // Two geoms may touch if one's category has a bit of the other's mask.
  std::uint32_t category = 1;
  std::uint32_t mask = 1;
};

// What drives a degree of freedom of a joint besides its spring.
enum class MotorKind : unsigned char {
  none,
  // The control is the force or torque itself (N, N m), clipped to max_effort.
  effort,
  // The control is the velocity (m/s, rad/s). With kd > 0 effort = kd (control - q'), else exact.
  velocity,
  // The control is the coordinate (m, rad). With kp > 0 effort = kp (control - q) - kd q', else exact within
  // one step, as far as max_effort can accelerate and brake.
  position,
};

// Motors act within the step, as rows of the same problem as contacts. A motor pushes as hard as it may
// against what is in its way, and a control that is out of reach leads to a motor at its largest effort.
struct Motor {
  MotorKind kind = MotorKind::none;
  double control = 0;            // initial; State::controls hold the present one
  double max_effort = infinity;  // N or N m, > 0
  double kp = 0;                 // of a position motor, N/m or N m/rad
  double kd = 0;                 // of a velocity motor, or a position motor with kp: N s/m or N m s/rad
};

// One degree of freedom of a joint: a hinge about, or a slide along, an axis given in frame_b at zero
// coordinates. The coordinate is the displacement (m) or angle (rad, counting full turns) of A relative to B.
struct Dof {
  enum class Kind : unsigned char { hinge, slide } kind = Kind::hinge;
  Vec3 axis{0, 0, 1};                          // unit
  Vec3 anchor{};                               // a point of the axis of a hinge, frame_b, m
  double lower = -infinity, upper = infinity;  // limits, m or rad
  double stiffness = 0, rest = 0;              // spring, N/m or N m/rad, coordinate at zero force
  double damping = 0;                          // N s/m or N m s/rad
  double friction = 0;                         // largest force or torque of dry friction, N or N m
  double armature = 0;                         // inertia of the drive, kg or kg m^2
  Motor motor{};
  // Of the sum that actuators put on the dof, themselves or by fixed tendons, as far as their efforts are
  // known before the step: N or N m.
  double lower_effort = -infinity, upper_effort = infinity;
};

enum class JointKind : unsigned char {
  // A = B moved by the dofs one after the other (product of exponentials); no dof: fixed. `spherical`: then a
  // free rotation about the origin of frame_a (ball joint).
  chain,
  // The distance of the two frame origins stays within [lower_distance, upper_distance].
  distance,
};

// frame_a, in body A, and frame_b, in body B, coincide at zero coordinates. Positive coordinates move A
// relative to B. Impulses of a joint act on A and, opposite, on B.
struct Joint {
  std::string name;
  JointKind kind = JointKind::chain;
  Index body_a = world, body_b = world;  // A may not be the world
  Transform frame_a, frame_b;
  std::vector<Dof> dofs;  // up to six
  bool spherical = false;
  // Of a spherical joint: stiffness and damping towards zero rotation (N m/rad, N m s/rad), dry friction
  // (N m), the largest rotation angle (rad); inertia of the drive (kg m^2).
  double ball_armature = 0;
  double ball_stiffness = 0, ball_damping = 0, ball_friction = 0, ball_limit = infinity;
  double lower_distance = 0, upper_distance = 0;  // m
  double compliance = 0;                          // of the locked directions, m/N; 0 is rigid
  bool collide = false;                           // whether the two bodies may touch each other
  // A condition between bodies that other joints place: its dofs are never generalised coordinates.
  bool closes_loop = false;
};

// One joint coordinate in a fixed tendon.
struct TendonTerm {
  Index joint = -1, dof = 0;
  double coefficient = 1;
};

// One stop of a spatial tendon on its way.
struct PathElement {
  enum class Kind : unsigned char {
    point,     // the tendon passes through the origin of the frame
    sphere,    // the tendon goes around, or through, the obstacle about the origin of the frame, if it meets
    cylinder,  // it; a cylinder is about the frame's third axis and has no ends
    pulley,    // the tendon begins anew at the next point, and lengths from here on count 1 / divisor
  } kind = Kind::point;
  Index body = world;
  Transform frame;    // in the body frame
  double radius = 0;  // of an obstacle, m
  // Of an obstacle: a point of side_body, in its frame (m), on whose side the tendon passes; where it lies
  // inside the obstacle, the tendon passes through. Without it, the tendon takes the shorter way round.
  std::optional<Vec3> side;
  Index side_body = world;
  double divisor = 1;  // of a pulley
};

// A length that several joints or bodies change, and what acts along it. `fixed` tendons are a linear
// combination of joint coordinates, their unit is that of the coordinates; spatial ones the length of a path.
// Forces pull where the length is to shrink: a positive effort works along a growing length.
struct Tendon {
  std::string name;
  std::vector<TendonTerm> terms;               // of a fixed tendon
  std::vector<PathElement> path;               // of a spatial one
  double lower = -infinity, upper = infinity;  // limits of the length, m or unit of the terms
  // A spring without force between the two rest lengths, N/m (N m/rad).
  double stiffness = 0, rest_lower = 0, rest_upper = 0;
  double damping = 0, friction = 0, armature = 0;  // as of a Dof
};

// coordinate a = polynomial in coordinate b. A coordinate is that of a dof of a joint, or, where a tendon is
// named, its length; b may be none (joint_b = tendon_b = -1): the constant coefficient alone.
struct Coupling {
  std::string name;
  Index joint_a = -1, dof_a = 0, joint_b = -1, dof_b = 0;
  std::vector<double> coefficients;  // ascending powers
  double compliance = 0;
  Index tendon_a = -1, tendon_b = -1;
};

// What an actuator moves: a length l (m or rad), of which the bodies' velocities are the rate. A unit effort
// of the actuator is a unit of work per unit of l.
struct Transmission {
  enum class Kind : unsigned char {
    dof,     // l = gear q
    tendon,  // l = gear times the tendon's length
    // A wrench `force`, `torque` per unit of effort, at the origin of `frame` on the body; the opposite acts
    // on the reference body. In the axes of the reference frame, l = <force, p> + <torque, r> with p the
    // position and r the rotation vector of frame as seen from there. In the frame's own axes (a thruster;
    // the reference body only takes the reaction) the force has no length: l = <torque, r>.
    wrench,
    // A rod of length `rod` joins the origin of `frame` (the crank) to a slider on the third axis of the
    // reference frame: l = gear times the slider's place on that axis.
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

// How the activation w of an actuator follows its control u.
enum class ActivationKind : unsigned char {
  none,        // w = u
  integrator,  // w' = u
  filter,      // w' = (u - w) / time_constant
};

// An effort that is affine in control, length and rate:
//   effort = clip(gain_0 w + gain_1 w l + gain_2 w l' + bias_0 + bias_1 l + bias_2 l', force limits).
// What of it holds back (the coefficients of l and l' that are not positive) acts within the step, as a row
// of the problem, the rest with the values at the start of the step.
struct Actuator {
  std::string name;
  Transmission transmission;
  std::array<double, 3> gain{1, 0, 0}, bias{0, 0, 0};
  double lower_force = -infinity, upper_force = infinity;  // N or N m
  double control = 0;                                      // initial
  double lower_control = -infinity, upper_control = infinity;
  ActivationKind dynamics = ActivationKind::none;
  double time_constant = 0;  // of a filter, s; 0: at once
  double activation = 0;     // initial
  double lower_activation = -infinity, upper_activation = infinity;
  bool early = false;  // the effort takes the activation of the end of the step
};

// A pair of geoms with a material of its own, in place of the combination of theirs; the last one given
// holds.
struct PairMaterial {
  Index geom_a, geom_b;
  Material material;
  bool always = false;  // they may touch whatever masks, exclusions and joints say
};

// What bodies move through: a fluid at rest but for the wind, which pushes on boxes.
struct Fluid {
  double density = 0;    // kg/m^3
  double viscosity = 0;  // dynamic, Pa s
  Vec3 wind;             // world axes, m/s
};

// How a body feels the fluid: as a box (forces: bodies/fluid.hpp).
struct FluidBox {
  Index body = world;
  Transform frame;  // of its centre and axes in the body frame
  Vec3 size;        // edges, m
};

// Plain data in the order in which things refer to each other: geoms and joints name bodies by their index,
// tendons, couplings and actuators joints, the last two tendons. Nothing is checked until a Model is made of
// it.
struct ModelDescription {
  Vec3 gravity{0, 0, -9.81};  // m/s^2
  std::vector<Body> bodies;
  std::vector<Geom> geoms;
  std::vector<Joint> joints;
  std::vector<Tendon> tendons;
  std::vector<Coupling> couplings;
  std::vector<Actuator> actuators;
  std::vector<PairMaterial> pair_materials;
  std::vector<std::pair<Index, Index>> excluded_bodies;  // pairs that never touch; world allowed
  std::vector<std::pair<Index, Index>> excluded_geoms;   // the same of geoms
  FrictionRule friction_rule = FrictionRule::geometric_mean;
  Fluid fluid;
  std::vector<FluidBox> fluid_boxes;
};

// Throws InputError naming the body, geom or joint and the remedy: mass or inertia not positive (or against
// the triangle inequality), poses that are not finite, names used twice, bodies that do not exist, a joint of
// a body with itself, limits in the wrong order, static-only shapes on moving bodies, and so on.
void check(const ModelDescription& description);

}  // namespace amontons
