#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "amontons/multibody/model/annotations.hpp"
#include "amontons/multibody/model/drive_parts.hpp"

// The data that users give, with the tables of the names of their fields. SI units; `world` (-1) as a body
// index is the inertial frame. Joints and drives are in the headers above.
namespace amontons {

// How the velocity of a body is determined.
enum class Motion : unsigned char {
  dynamic,    // moved by forces and impulses
  kinematic,  // moves with the velocity in the state; forces do not change it
  still,      // does not move; "static" in files and in Python
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
  Index link = own_link;  // the part of the body that it belongs to
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

// A point at which two bodies hold together, as mortar does: it pulls them together with `tension` until the
// two points are farther apart than `opening`, and then never again. Their contact bears this pull, so that
// it resists opening up to `tension`, and sliding up to the friction of it.
struct Bond {
  Index body_a = world, body_b = world;
  Vec3 point_a, point_b;  // in the body frames, m; one place before anything moves
  Vec3 normal{0, 0, 1};   // from B to A, frame of body B, a unit vector
  double tension = 0;     // N, > 0
  double opening = 0;     // m, > 0
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
  std::vector<Bond> bonds;
  std::vector<NamedLink> links;
  std::vector<Site> sites;
  std::vector<Sensor> sensors;
  std::vector<Visual> visuals;
  std::vector<Keyframe> keyframes;
  std::vector<Unread> unread;
};

namespace detail {
AMONTONS_FIELDS(Transform, position, rotation);
AMONTONS_FIELDS(Material, friction, restitution, compliance, relaxation_time, rest_offset, friction_across,
                torsional_friction, rolling_friction, friction_static, stribeck_speed);
AMONTONS_FIELDS(Body, name, motion, mass, centre_of_mass, inertia, gravity_scale, pose, linear_velocity,
                angular_velocity);
AMONTONS_FIELDS(Geom, name, body, frame, shape, material, surface_velocity, surface_spin, friction_direction,
                category, mask, link);
AMONTONS_FIELDS(PairMaterial, geom_a, geom_b, material, always);
AMONTONS_FIELDS(Fluid, density, viscosity, wind);
AMONTONS_FIELDS(FluidBox, body, frame, size);
AMONTONS_FIELDS(Bond, body_a, body_b, point_a, point_b, normal, tension, opening);
AMONTONS_FIELDS(ModelDescription, gravity, bodies, geoms, joints, tendons, couplings, actuators,
                pair_materials, excluded_bodies, excluded_geoms, fluid, fluid_boxes, bonds, friction_rule,
                trees, links, sites, sensors, visuals, keyframes, unread);
template <>
inline constexpr auto values_of<Motion> = std::array{
    Named{"dynamic", Motion::dynamic}, Named{"kinematic", Motion::kinematic}, Named{"static", Motion::still}};
AMONTONS_VALUES(FrictionRule, geometric_mean, maximum, minimum, mean);
template <>
inline constexpr auto values_of<Trees> =
    std::array{Named{"none", Trees::none}, Named{"auto", Trees::automatic}};
}  // namespace detail

// Throws InputError naming the body, geom or joint and the remedy. Causes are: mass or inertia that is not
// positive (or violates the triangle inequality), poses that are not finite, duplicate names, missing bodies.
// Further causes are a joint of a body with itself, limits in the wrong order, static-only shapes on moving
// bodies, and so on.
void check(const ModelDescription& description);

}  // namespace amontons
