#include "amontons/multibody/model/builder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <string_view>

#include "amontons/base/elementary.hpp"
#include "amontons/base/error.hpp"

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

// A world frame in the frame of a body at its initial pose. Positions are subtracted first: that is exact for
// frames near the body, however far both are from the origin.
Transform local(const JointEnd& end, const Transform& frame) {
  if (end.body == world) return frame;
  const Quat back = conjugate(end.pose.rotation);
  return {rotate(back, frame.position - end.pose.position), back * frame.rotation};
}

Vec3 direction(const std::string& who, const char* what, const Vec3& axis) {
  AMONTONS_REQUIRE(is_finite(axis) && !(axis == Vec3{}),
                   who + ": " + what + " is zero, not finite or not given; give a direction in the world");
  // Divided by the largest entry first, so that squares do not overflow or underflow.
  const double scale = std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
  return normalised(axis / scale);
}

// A degree of freedom of a kind of joint, along or about an axis of the frame of the joint.
struct Freedom {
  Dof::Kind kind = Dof::Kind::hinge;
  Vec3 axis{0, 0, 1};
};
constexpr Freedom hinge{Dof::Kind::hinge}, slide{Dof::Kind::slide};
constexpr Freedom slide_x{Dof::Kind::slide, {1, 0, 0}}, slide_y{Dof::Kind::slide, {0, 1, 0}};

// A kind of joint that is a chain of `dofs` freedoms. The third axis of its frame is the axis of the joint;
// without an axis the frame is turned as body B. With clearance only the freedom `own` takes what users give.
struct Chain {
  std::string_view name;
  bool needs_point, has_axis;
  std::size_t dofs = 0;
  std::array<Freedom, 3> freedoms{};
  bool spherical = false;
  int own = -1;
};
constexpr Chain chains[] = {
    {"ball", true, false, 0, {}, true},
    {"revolute", true, true, 1, {hinge}},
    {"prismatic", false, true, 1, {slide}},
    {"cylindrical", true, true, 2, {slide, hinge}},
    {"universal", true, true, 2, {hinge, hinge}},
    {"planar", false, true, 3, {slide_x, slide_y, hinge}},
    {"fixed", false, false},
    {"point_on_line", true, true, 1, {slide}, true},
    {"journal", true, true, 3, {slide_x, slide_y, hinge}, false, 2},
    {"slider", false, true, 3, {slide_x, slide_y, hinge}, false, 0},
};
const Chain& chain_of(const std::string& kind) {
  const Chain* chain =
      std::find_if(std::begin(chains), std::end(chains), [&](const Chain& c) { return c.name == kind; });
  AMONTONS_REQUIRE(chain != std::end(chains), "there is no kind of joint " + kind);
  return *chain;
}

// The kind with clearance, once its data are known to be complete.
const Chain& with_clearance(const std::string& kind, const NewJoint& given, const std::string& who) {
  const bool none = given.clearance == 0;
  for (const auto& [value, name] : {std::pair(given.guide_length, "guide_length"),
                                    {given.journal_radius, "journal_radius"},
                                    {given.clearance_friction, "clearance_friction"}})
    AMONTONS_REQUIRE(!none || value == 0,
                     who + ": " + name + " without clearance; give the clearance, as clearance=1e-4");
  if (none) return chain_of(kind);
  AMONTONS_REQUIRE(kind == "revolute" || kind == "prismatic",
                   who + ": clearance is for revolute and prismatic joints");
  AMONTONS_REQUIRE(kind == "revolute" || (given.guide_length > 0 && !(given.guide_normal == Vec3{})),
                   who + ": clearance needs guide_length > 0 and guide_normal");
  return chain_of(kind == "revolute" ? "journal" : "slider");
}

// The rotation of the frame of a slider with clearance, whose first axis is that of the joint and whose third
// is the normal of the plane in which it tilts.
Quat along_slider(const NewJoint& given, const Vec3& x, const std::string& who) {
  const Vec3 z = direction(who, "guide_normal", given.guide_normal);
  AMONTONS_REQUIRE(std::abs(dot(x, z)) <= 1e-6,
                   who + ": guide_normal is not normal to the axis; give a perpendicular one");
  const Quat turn = rotation_to_z(z);
  const Vec3 first = rotate(turn, {1, 0, 0});
  const double half = 0.5 * elementary::atan2(dot(first, cross(z, x)), dot(first, x));
  return turn * Quat{elementary::cos(half), 0, 0, -elementary::sin(half)};
}

// Body A exists and differs from B; a joint to the world has the world as B, so that its frame moves with A.
Joint between(const std::string& who, const std::string& name, const JointEnd& a, const JointEnd& b) {
  AMONTONS_REQUIRE(a.body != world, who + ": body A must not be the world; swap the bodies");
  AMONTONS_REQUIRE(a.body != b.body, who + " joins a body to itself; it needs two bodies");
  Joint joint;
  joint.name = name, joint.body_a = a.body, joint.body_b = b.body;
  return joint;
}

}  // namespace

// Mass, centre and inertia of a body from what is given of it. The shape gives what is not given, at a
// uniform density. Shapes without a volume (planes, meshes of the world) have no mass of their own: for them
// the inertia must be given.
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

std::size_t dofs_of_kind(const std::string& kind) { return chain_of(kind).dofs; }

// The frame of the joint has its origin at the given point and its third axis along that of the joint. Both
// bodies keep it in their own coordinates at their initial poses, so that the joint is closed at the start.
Joint joint_between(const std::string& kind, const JointEnd& a, const JointEnd& b, const NewJoint& given) {
  const std::string who = quoted("joint", given.name);
  const Chain& chain = with_clearance(kind, given, who);
  Joint joint = between(who, given.name, a, b);
  AMONTONS_REQUIRE(given.point || !chain.needs_point, who + ": point is not given; give one in the world");
  const std::size_t n = chain.own < 0 ? chain.dofs : 1;
  AMONTONS_REQUIRE(given.dofs.empty() || given.dofs.size() == n,
                   who + ": dofs has " + std::to_string(given.dofs.size()) + " entries; the joint has " +
                       std::to_string(n) + " degrees of freedom");
  Transform frame{given.point.value_or((a.pose * a.part).position), (b.pose * b.part).rotation};
  Vec3 axis;
  if (chain.has_axis) {
    axis = direction(who, "axis", given.axis);
    frame.rotation =
        kind == "prismatic" && chain.own >= 0 ? along_slider(given, axis, who) : rotation_to_z(axis);
  }
  joint.frame_a = local(a, frame), joint.frame_b = local(b, frame);
  joint.spherical = chain.spherical;
  joint.compliance = given.compliance, joint.collide = given.collide;
  joint.clearance = given.clearance, joint.guide_length = given.guide_length;
  joint.journal_radius = given.journal_radius, joint.clearance_friction = given.clearance_friction;
  for (std::size_t k = 0; k < chain.dofs; ++k) {
    Dof& dof = joint.dofs.emplace_back();
    if (chain.own < 0) dof = given.dofs.empty() ? given.dof : given.dofs[k];
    if (chain.own == static_cast<int>(k)) dof = given.dofs.empty() ? given.dof : given.dofs[0];
    dof.kind = chain.freedoms[k].kind, dof.axis = chain.freedoms[k].axis, dof.anchor = {};
  }
  if (kind == "universal") {
    const Vec3 second = direction(who, "axis_2", given.axis_2);
    AMONTONS_REQUIRE(norm_squared(cross(axis, second)) >= 1e-6,
                     who + ": the two axes are parallel; give two directions");
    joint.dofs[1].axis = rotate(conjugate(frame.rotation), second);
  }
  if (kind == "ball") {
    joint.ball_stiffness = given.dof.stiffness, joint.ball_damping = given.dof.damping;
    joint.ball_friction = given.dof.friction, joint.ball_armature = given.dof.armature;
    joint.ball_limit = given.dof.upper;
  }
  return joint;
}

// A rod keeps the distance of two points, or keeps it between two limits. Its length is by default that of
// the start; from zero length a distance has no direction.
Joint rod_between(const JointEnd& a, const JointEnd& b, const NewRod& given) {
  const std::string who = quoted("joint", given.name);
  Joint joint = between(who, given.name, a, b);
  const bool limits = given.lower || given.upper;
  AMONTONS_REQUIRE(!(limits && given.length), who + ": length and limits are both given; keep one of them");
  const double length = given.length.value_or(norm(given.point_a - given.point_b));
  AMONTONS_REQUIRE(limits || length > 0, who + ": the length must be positive, or use a ball joint");
  joint.kind = JointKind::distance;
  joint.frame_a = local(a, {given.point_a, {}});
  joint.frame_b = local(b, {given.point_b, {}});
  joint.lower_distance = limits ? given.lower.value_or(0) : length;
  joint.upper_distance = limits ? given.upper.value_or(infinity) : length;
  joint.compliance = given.compliance, joint.collide = given.collide;
  return joint;
}

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

JointEnd ModelBuilder::end(Reference body, const std::string& joint) const {
  try {
    const Index b = body.body_among(d_.bodies);
    return {b, b == world ? Transform{} : d_.bodies[b].pose, {}};
  } catch (const InputError& error) {
    throw InputError(quoted("joint", joint) + ": " + error.what());
  }
}

Index ModelBuilder::add(const char* kind, Reference a, Reference b, const NewJoint& given) {
  return append(d_.joints, joint_between(kind, end(a, given.name), end(b, given.name), given));
}

Index ModelBuilder::add_distance_joint(Reference a, Reference b, const NewRod& given) {
  return append(d_.joints, rod_between(end(a, given.name), end(b, given.name), given));
}

void ModelBuilder::exclude(Reference a, Reference b) {
  const Index first = a.body_among(d_.bodies), second = b.body_among(d_.bodies);
  AMONTONS_REQUIRE(first != second, "exclude: a body never touches itself; give two bodies");
  d_.excluded_bodies.emplace_back(first, second);
}

}  // namespace amontons
