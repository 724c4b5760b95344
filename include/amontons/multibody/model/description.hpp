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
template <>
inline constexpr auto fields<Transform> =
    std::tuple(Field{"position", &Transform::position}, Field{"rotation", &Transform::rotation});
template <>
inline constexpr auto fields<Material> = std::tuple(
    Field{"friction", &Material::friction}, Field{"restitution", &Material::restitution},
    Field{"compliance", &Material::compliance}, Field{"relaxation_time", &Material::relaxation_time},
    Field{"rest_offset", &Material::rest_offset}, Field{"friction_across", &Material::friction_across},
    Field{"torsional_friction", &Material::torsional_friction},
    Field{"rolling_friction", &Material::rolling_friction},
    Field{"friction_static", &Material::friction_static}, Field{"stribeck_speed", &Material::stribeck_speed});
template <>
inline constexpr auto fields<Body> = std::tuple(
    Field{"name", &Body::name}, Field{"motion", &Body::motion}, Field{"mass", &Body::mass},
    Field{"centre_of_mass", &Body::centre_of_mass}, Field{"inertia", &Body::inertia},
    Field{"gravity_scale", &Body::gravity_scale}, Field{"pose", &Body::pose},
    Field{"linear_velocity", &Body::linear_velocity}, Field{"angular_velocity", &Body::angular_velocity});
template <>
inline constexpr auto fields<Geom> =
    std::tuple(Field{"name", &Geom::name}, Field{"body", &Geom::body}, Field{"frame", &Geom::frame},
               Field{"shape", &Geom::shape}, Field{"material", &Geom::material},
               Field{"surface_velocity", &Geom::surface_velocity}, Field{"surface_spin", &Geom::surface_spin},
               Field{"friction_direction", &Geom::friction_direction}, Field{"category", &Geom::category},
               Field{"mask", &Geom::mask}, Field{"link", &Geom::link});
template <>
inline constexpr auto fields<PairMaterial> =
    std::tuple(Field{"geom_a", &PairMaterial::geom_a}, Field{"geom_b", &PairMaterial::geom_b},
               Field{"material", &PairMaterial::material}, Field{"always", &PairMaterial::always});
template <>
inline constexpr auto fields<Fluid> = std::tuple(
    Field{"density", &Fluid::density}, Field{"viscosity", &Fluid::viscosity}, Field{"wind", &Fluid::wind});
template <>
inline constexpr auto fields<FluidBox> = std::tuple(
    Field{"body", &FluidBox::body}, Field{"frame", &FluidBox::frame}, Field{"size", &FluidBox::size});
template <>
inline constexpr auto fields<Bond> = std::tuple(
    Field{"body_a", &Bond::body_a}, Field{"body_b", &Bond::body_b}, Field{"point_a", &Bond::point_a},
    Field{"point_b", &Bond::point_b}, Field{"normal", &Bond::normal}, Field{"tension", &Bond::tension},
    Field{"opening", &Bond::opening});
template <>
inline constexpr auto fields<ModelDescription> = std::tuple(
    Field{"gravity", &ModelDescription::gravity}, Field{"bodies", &ModelDescription::bodies},
    Field{"geoms", &ModelDescription::geoms}, Field{"joints", &ModelDescription::joints},
    Field{"tendons", &ModelDescription::tendons}, Field{"couplings", &ModelDescription::couplings},
    Field{"actuators", &ModelDescription::actuators},
    Field{"pair_materials", &ModelDescription::pair_materials},
    Field{"excluded_bodies", &ModelDescription::excluded_bodies},
    Field{"excluded_geoms", &ModelDescription::excluded_geoms}, Field{"fluid", &ModelDescription::fluid},
    Field{"fluid_boxes", &ModelDescription::fluid_boxes}, Field{"bonds", &ModelDescription::bonds},
    Field{"friction_rule", &ModelDescription::friction_rule}, Field{"trees", &ModelDescription::trees},
    Field{"links", &ModelDescription::links}, Field{"sites", &ModelDescription::sites},
    Field{"sensors", &ModelDescription::sensors}, Field{"visuals", &ModelDescription::visuals},
    Field{"keyframes", &ModelDescription::keyframes}, Field{"unread", &ModelDescription::unread});
template <>
inline constexpr auto values_of<Motion> = std::array{
    Named{"dynamic", Motion::dynamic}, Named{"kinematic", Motion::kinematic}, Named{"static", Motion::still}};
template <>
inline constexpr auto values_of<FrictionRule> =
    std::array{Named{"geometric_mean", FrictionRule::geometric_mean}, Named{"maximum", FrictionRule::maximum},
               Named{"minimum", FrictionRule::minimum}, Named{"mean", FrictionRule::mean}};
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
