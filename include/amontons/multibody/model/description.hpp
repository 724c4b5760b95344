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

// The data that users give. SI units; `world` (-1) as a body index is the inertial frame.
namespace amontons {

constexpr double infinity = std::numeric_limits<double>::infinity();

// How the velocity of a body is determined.
enum class Motion : unsigned char {
  dynamic,    // moved by forces and impulses
  kinematic,  // moves with the velocity in the state; forces do not change it
  fixed,      // does not move
};

// A rigid body: a frame for its geoms and joints, and its mass.
struct Body {
  std::string name;
  Motion motion = Motion::dynamic;
  // Mass and inertia are not read if the body is not dynamic.
  double mass = 0;                         // kg, > 0 if dynamic
  Vec3 centre_of_mass;                     // in the body frame, m
  Mat3 inertia;                            // about the centre of mass, body axes, kg m^2
  double gravity_scale = 1;                // weight over mass times gravity; 0: no weight
  Transform pose;                          // initial pose of the body frame in the world
  Vec3 linear_velocity, angular_velocity;  // initial, at the frame's origin, world axes, m/s, rad/s
};

// Rule that combines the friction of two materials. For restitution, torsional and rolling friction the
// larger value counts: they are often given for one of the two only. Compliances add (springs in series);
// each relaxes at its own rate, and the pair at the mean by compliance. Rest offsets add.
enum class FrictionRule : unsigned char { geometric_mean, maximum, minimum, mean };

// Which bodies move in coordinates of their joints, in which the joints hold exactly.
enum class Trees : unsigned char {
  none,       // none: joints are rows of the step's problem
  automatic,  // those of mechanisms whose rigid joints form a tree; joints that close its loops are rows
};

// A shape on a body, with the material of its surface. A body may have any number of geoms, or none. Its mass
// and inertia do not depend on them.
struct Geom {
  std::string name;
  Index body = world;
  Transform frame;  // pose of the shape in the body frame
  Shape shape = Sphere{1};
  Material material;
  Vec3 surface_velocity;  // of the surface relative to the body, body frame, m/s (conveyors, tracks)
  Vec3 surface_spin;      // of the surface about the geom's origin, body frame, rad/s (turntables)
  // Direction of material.friction, body frame; zero only without friction_across.
  Vec3 friction_direction;
  // Two geoms may touch if the category of one has a bit of the other's mask.
  std::uint32_t category = 1;
  std::uint32_t mask = 1;
};

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
  // normal; 0: none. With play_length (m) > 0 the play is that of a slider on the first slide, at both of its
  // ends.
  double play = 0, play_length = 0;
  double journal_radius = 0, play_friction = 0;  // lever of the friction of a journal, m; mu
};

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

// A material for a pair of geoms, which replaces the combination of theirs; the last one given counts.
struct PairMaterial {
  Index geom_a, geom_b;
  Material material;
  bool always = false;  // they may touch regardless of masks, exclusions and joints
};

// The fluid around the bodies, at rest except for the wind; it acts on boxes.
struct Fluid {
  double density = 0;    // kg/m^3
  double viscosity = 0;  // dynamic, Pa s
  Vec3 wind;             // world axes, m/s
};

// The box by which the fluid acts on a body (forces: bodies/fluid.hpp).
struct FluidBox {
  Index body = world;
  Transform frame;  // pose of its centre and axes in the body frame
  Vec3 size;        // edges, m
};

// Plain data in the order of their references: geoms and joints name bodies by index; tendons, couplings and
// actuators name joints; the last two also tendons. Nothing is checked until a Model is made.
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
  std::vector<std::pair<Index, Index>> excluded_geoms;   // the same for geoms
  FrictionRule friction_rule = FrictionRule::geometric_mean;
  Trees trees = Trees::none;
  Fluid fluid;
  std::vector<FluidBox> fluid_boxes;
};

// Throws InputError naming the body, geom or joint and the remedy. Causes are: mass or inertia that is not
// positive (or violates the triangle inequality), poses that are not finite, duplicate names, missing bodies.
// Further causes are a joint of a body with itself, limits in the wrong order, static-only shapes on moving
// bodies, and so on.
void check(const ModelDescription& description);

}  // namespace amontons
