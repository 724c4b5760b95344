#include "amontons/multibody/model/builder.hpp"

#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/collision/shapes/mass.hpp"

namespace amontons {
namespace {

template <class Things, class Thing>
Index append(Things& things, Thing thing) {
  things.push_back(std::move(thing));
  return static_cast<Index>(things.size() - 1);
}

std::string quoted(const char* kind, const std::string& name) {
  return name.empty() ? std::string(kind) + " without a name" : std::string(kind) + " \"" + name + "\"";
}

// Mass properties of a body from one source: the shape and one number, or mass and inertia.
MassProperties solid_of(const NewBody& given, const std::string& who) {
  AMONTONS_REQUIRE(!(given.density != 0 && given.mass != 0),
                   who + ": density and mass are both given; keep one of them");
  AMONTONS_REQUIRE(given.density == 0 || given.shape, who + ": density is given without a shape");
  AMONTONS_REQUIRE(given.mass == 0 || given.shape || given.inertia,
                   who + ": mass is given without a shape or inertia; give inertia about the centre");
  AMONTONS_REQUIRE(!given.inertia || given.mass != 0 || given.density != 0,
                   who + ": inertia is given without mass; give both");
  AMONTONS_REQUIRE(given.density >= 0 && given.mass >= 0, who + ": density and mass must not be negative");
  MassProperties solid;
  if (given.shape && !(given.inertia && is_static_only(*given.shape)) &&
      (given.density != 0 || given.mass != 0)) {
    const double unit = mass_properties(*given.shape).mass;
    solid = mass_properties(*given.shape, given.density != 0 ? given.density : given.mass / unit);
  }
  if (given.mass != 0) solid.mass = given.mass;  // exact to the last bit
  if (given.inertia) solid.inertia = *given.inertia;
  if (given.centre_of_mass) solid.centre_of_mass = *given.centre_of_mass;
  return solid;
}

// A world frame in the frame of a body at its initial pose. Positions are subtracted first: that is exact for
// frames near the body, however far both are from the origin.
Transform local(const ModelDescription& d, Index body, const Transform& frame) {
  if (body == world) return frame;
  const Transform& pose = d.bodies[body].pose;
  const Quat back = conjugate(pose.rotation);
  return {rotate(back, frame.position - pose.position), back * frame.rotation};
}

Vec3 direction(const std::string& who, const char* what, const Vec3& axis) {
  AMONTONS_REQUIRE(is_finite(axis) && !(axis == Vec3{}),
                   who + ": " + what + " is zero, not finite or not given; give a direction in the world");
  // Divided by the largest entry first, so that squares do not overflow or underflow.
  const double scale = std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
  return normalised(axis / scale);
}

// The rotation of a frame whose third axis is the axis of the joint.
Quat along(const char* kind, const NewJoint& given) {
  return rotation_to_z(direction(quoted(kind, given.name), "axis", given.axis));
}

}  // namespace

Index ModelBuilder::add_body(const std::string& name, const NewBody& given) {
  const std::string who = quoted("body", name);
  AMONTONS_REQUIRE(name != "world", who + ": that is the name of the world; give another one");
  AMONTONS_REQUIRE(!given.shape || !is_static_only(*given.shape) || given.motion != Motion::dynamic,
                   who + ": planes, meshes and height fields do not move; give the body a convex shape");
  const MassProperties solid = solid_of(given, who);
  Body body;
  body.name = name, body.motion = given.motion;
  body.mass = solid.mass, body.centre_of_mass = solid.centre_of_mass, body.inertia = solid.inertia;
  body.gravity_scale = given.gravity_scale;
  body.pose = {given.position, given.orientation};
  body.linear_velocity = given.linear_velocity, body.angular_velocity = given.angular_velocity;
  if (given.shape) {
    Geom geom;
    geom.body = static_cast<Index>(d_.bodies.size()), geom.shape = *given.shape;
    geom.material = given.material, geom.friction_direction = given.friction_direction;
    d_.geoms.push_back(geom);
  }
  return append(d_.bodies, body);
}

Index ModelBuilder::add_geom(Reference on, const Shape& shape, const NewGeom& given) {
  Geom geom;
  geom.name = given.name, geom.body = on.body_among(d_.bodies);
  geom.frame = {given.position, given.orientation};
  geom.shape = shape, geom.material = given.material;
  geom.surface_velocity = given.surface_velocity, geom.surface_spin = given.surface_spin;
  geom.friction_direction = given.friction_direction;
  geom.category = given.category, geom.mask = given.mask;
  if (given.density != 0 && geom.body != world) {
    Body& body = d_.bodies[geom.body];
    const MassProperties sum = MassProperties{body.mass, body.centre_of_mass, body.inertia} +
                               moved(mass_properties(shape, given.density), geom.frame);
    body.mass = sum.mass, body.centre_of_mass = sum.centre_of_mass, body.inertia = sum.inertia;
  }
  return append(d_.geoms, geom);
}

Index ModelBuilder::add_floor(double height, const Material& material, const std::string& name) {
  constexpr std::uint32_t everything = 0xffffffff;
  return add_geom(world, Plane{},
                  {.name = name,
                   .position = {0, 0, height},
                   .material = material,
                   .category = everything,
                   .mask = everything});
}

Joint ModelBuilder::between(const std::string& who, const std::string& name, Reference a, Reference b) const {
  Joint joint;
  joint.name = name;
  try {
    joint.body_a = a.body_among(d_.bodies), joint.body_b = b.body_among(d_.bodies);
  } catch (const InputError& error) {
    throw InputError(who + ": " + error.what());
  }
  AMONTONS_REQUIRE(joint.body_a != world, who + ": body A must not be the world; swap the bodies");
  AMONTONS_REQUIRE(joint.body_a != joint.body_b, who + " joins a body to itself; it needs two bodies");
  return joint;
}

Index ModelBuilder::add_chain(const char* kind, Reference a, Reference b, const NewJoint& given, Use point,
                              std::optional<Quat> rotation, std::initializer_list<Freedom> freedoms,
                              bool spherical) {
  const std::string who = quoted(kind, given.name);
  Joint joint = between(who, given.name, a, b);
  AMONTONS_REQUIRE(given.point || point == Use::optional,
                   who + ": point is not given; give one in the world");
  AMONTONS_REQUIRE(given.dofs.empty() || given.dofs.size() == freedoms.size(),
                   who + ": dofs has " + std::to_string(given.dofs.size()) + " entries; the joint has " +
                       std::to_string(freedoms.size()) + " degrees of freedom");
  const Quat as_b = joint.body_b == world ? Quat{} : d_.bodies[joint.body_b].pose.rotation;
  const Transform frame{given.point.value_or(d_.bodies[joint.body_a].pose.position), rotation.value_or(as_b)};
  joint.frame_a = local(d_, joint.body_a, frame), joint.frame_b = local(d_, joint.body_b, frame);
  joint.spherical = spherical;
  joint.compliance = given.compliance, joint.collide = given.collide;
  for (const Freedom& freedom : freedoms) {
    Dof& dof =
        joint.dofs.emplace_back(given.dofs.empty() ? given.dof : given.dofs[&freedom - std::data(freedoms)]);
    dof.kind = freedom.kind, dof.axis = freedom.axis, dof.anchor = {};
  }
  return append(d_.joints, joint);
}

Index ModelBuilder::add_ball_joint(Reference a, Reference b, const NewJoint& given) {
  const Index index = add_chain("ball joint", a, b, given, Use::required, {}, {}, true);
  Joint& joint = d_.joints[index];
  joint.ball_stiffness = given.dof.stiffness, joint.ball_damping = given.dof.damping;
  joint.ball_friction = given.dof.friction, joint.ball_armature = given.dof.armature;
  joint.ball_limit = given.dof.upper;
  return index;
}

Index ModelBuilder::add_revolute_joint(Reference a, Reference b, const NewJoint& given) {
  const char* kind = "revolute joint";
  return add_chain(kind, a, b, given, Use::required, along(kind, given), {{Dof::Kind::hinge}});
}

Index ModelBuilder::add_prismatic_joint(Reference a, Reference b, const NewJoint& given) {
  const char* kind = "prismatic joint";
  return add_chain(kind, a, b, given, Use::optional, along(kind, given), {{Dof::Kind::slide}});
}

Index ModelBuilder::add_cylindrical_joint(Reference a, Reference b, const NewJoint& given) {
  const char* kind = "cylindrical joint";
  return add_chain(kind, a, b, given, Use::required, along(kind, given),
                   {{Dof::Kind::slide}, {Dof::Kind::hinge}});
}

Index ModelBuilder::add_universal_joint(Reference a, Reference b, const NewJoint& given) {
  const char* kind = "universal joint";
  const std::string who = quoted(kind, given.name);
  const Quat rotation = along(kind, given);
  const Vec3 first = direction(who, "axis", given.axis), second = direction(who, "axis_2", given.axis_2);
  AMONTONS_REQUIRE(norm_squared(cross(first, second)) >= 1e-6,
                   who + ": axis and axis_2 are parallel; give two directions");
  return add_chain(kind, a, b, given, Use::required, rotation,
                   {{Dof::Kind::hinge}, {Dof::Kind::hinge, rotate(conjugate(rotation), second)}});
}

Index ModelBuilder::add_planar_joint(Reference a, Reference b, const NewJoint& given) {
  const char* kind = "planar joint";
  return add_chain(kind, a, b, given, Use::optional, along(kind, given),
                   {{Dof::Kind::slide, {1, 0, 0}}, {Dof::Kind::slide, {0, 1, 0}}, {Dof::Kind::hinge}});
}

Index ModelBuilder::add_fixed_joint(Reference a, Reference b, const NewJoint& given) {
  return add_chain("fixed joint", a, b, given, Use::optional, {}, {});
}

Index ModelBuilder::add_point_on_line_joint(Reference a, Reference b, const NewJoint& given) {
  const char* kind = "point-on-line joint";
  return add_chain(kind, a, b, given, Use::required, along(kind, given), {{Dof::Kind::slide}}, true);
}

Index ModelBuilder::add_distance_joint(Reference a, Reference b, const NewRod& given) {
  const std::string who = quoted("distance joint", given.name);
  Joint joint = between(who, given.name, a, b);
  const bool limits = given.lower || given.upper;
  AMONTONS_REQUIRE(!(limits && given.length), who + ": length and limits are both given; keep one of them");
  const double length = given.length.value_or(norm(given.point_a - given.point_b));
  AMONTONS_REQUIRE(limits || length > 0, who + ": the length must be positive, or use a ball joint");
  joint.kind = JointKind::distance;
  joint.frame_a = local(d_, joint.body_a, {given.point_a, {}});
  joint.frame_b = local(d_, joint.body_b, {given.point_b, {}});
  joint.lower_distance = limits ? given.lower.value_or(0) : length;
  joint.upper_distance = limits ? given.upper.value_or(infinity) : length;
  joint.compliance = given.compliance, joint.collide = given.collide;
  return append(d_.joints, joint);
}

void ModelBuilder::exclude(Reference a, Reference b) {
  const Index first = a.body_among(d_.bodies), second = b.body_among(d_.bodies);
  AMONTONS_REQUIRE(first != second, "exclude: a body never touches itself; give two bodies");
  d_.excluded_bodies.emplace_back(first, second);
}

}  // namespace amontons
