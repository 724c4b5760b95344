#pragma once
#include <optional>
#include <string>

#include "amontons/collision/shapes/shapes.hpp"
#include "amontons/multibody/model/model.hpp"

namespace amontons {

// Data of a new body besides its name.
struct NewBody {
  // Pose of the body frame in the world: m, unit quaternion.
  Vec3 position{};
  Quat orientation{};
  // Shape at the origin of the body frame, with `material`; add_geom adds more.
  std::optional<Shape> shape{};
  // Mass of a dynamic body. Either the density (kg/m^3) of the shape; or the mass (kg) and the inertia (kg
  // m^2, about the centre of mass, body axes), unless the shape gives it. A body with neither gets its mass
  // from geoms with a density.
  double density = 0, mass = 0;
  std::optional<Mat3> inertia{};
  std::optional<Vec3> centre_of_mass{};  // m, body frame
  Motion motion = Motion::dynamic;
  Vec3 linear_velocity{}, angular_velocity{};  // initial, at the frame's origin, world axes, m/s, rad/s
  double gravity_scale = 1;
  Material material{};
  Vec3 friction_direction{};  // as in Geom
};

// Data of a new shape on a body. `density` (kg/m^3) adds its mass to the body; 0 adds none.
struct NewGeom {
  std::string name{};
  Vec3 position{};  // of the shape in the body frame, m
  Quat orientation{};
  Material material{};
  double density = 0;
  Vec3 surface_velocity{}, surface_spin{};  // these and the following as in Geom
  Vec3 friction_direction{};
  std::uint32_t category = 1, mask = 1;
};

// Data of a new joint. Points (m) and axes (of any nonzero length) are in the world at the initial poses of
// the bodies, where all coordinates are zero.
struct NewJoint {
  std::string name{};
  std::optional<Vec3> point{};  // default: the origin of A, for joints that need no point
  Vec3 axis{};                  // for a planar joint its normal
  Vec3 axis_2{};                // for a universal joint, the axis that is fixed in A

  // Limits, spring, damper, friction, drive and motor of every degree of freedom; kind, axis and anchor come
  // from the joint. A ball uses stiffness, damping, friction and armature, and `upper` as its limit.
  Dof dof{};
  std::vector<Dof> dofs{};
  double compliance = 0;  // of the locked directions, m/N; 0: rigid
  bool collide = false;   // whether the two bodies may touch

  // The clearance of a revolute or prismatic joint, as in Joint; 0: none. A joint with clearance has three
  // degrees of freedom; the one along or about the axis takes `dof`. A slider tilts in the plane with the
  // normal guide_normal.
  double clearance = 0, guide_length = 0, journal_radius = 0, clearance_friction = 0;
  Vec3 guide_normal{};
};

// A rod keeps the distance of a point of A and a point of B (initial, in the world) at `length` (m) or at the
// initial distance. With limits it is a rope or a stop.
struct NewRod {
  std::string name{};
  Vec3 point_a{}, point_b{};
  std::optional<double> length{}, lower{}, upper{};
  double compliance = 0;
  bool collide = false;
};

namespace detail {
AMONTONS_FIELDS(NewBody, shape, density, mass, inertia, centre_of_mass);
AMONTONS_FIELDS(NewJoint, name, point, axis, axis_2, dof, dofs, compliance, collide, clearance, guide_length,
                journal_radius, clearance_friction, guide_normal);
AMONTONS_FIELDS(NewRod, name, point_a, point_b, length, lower, upper);
}  // namespace detail

// The end of a joint: a body, its initial pose, and in it the frame of the part that the joint holds.
struct JointEnd {
  Index body = world;
  Transform pose{}, part{};
};

// The arithmetic of the builders of both languages. A kind of joint is the part of the name of a function
// below between "add_" and "_joint", but for "distance".
Joint joint_between(const std::string& kind, const JointEnd& a, const JointEnd& b, const NewJoint& given);
Joint rod_between(const JointEnd& a, const JointEnd& b, const NewRod& given);
// The number of degrees of freedom that take a `dof` of their own.
std::size_t dofs_of_kind(const std::string& kind);
// Mass properties of a body from one source: the shape and one number, or mass and inertia. `who` begins
// messages.
MassProperties solid_of(const NewBody& given, const std::string& who);

// Makes the description of a model. A body is referred to
// by the index that add_body returns or by its name; "world" is the world. Parts without a function here are
// plain data in description(). Functions throw InputError naming the thing and the remedy, and then add
// nothing. build() checks the whole model.
class ModelBuilder {
 public:
  ModelBuilder() = default;
  // Continues from a description, for example of a file.
  explicit ModelBuilder(ModelDescription description) : d_(std::move(description)) {}

  // Each returns the index of the new part. Without a name the part is known by its index only.
  Index add_body(const std::string& name, const NewBody& body = {});
  Index add_geom(Reference body, const Shape& shape, const NewGeom& geom = {});
  // A plane on the world at a height (m). It touches every shape that may touch anything.
  Index add_floor(double height = 0, const Material& material = {}, const std::string& name = "floor");

  // Every joint moves A relative to B; A may not be the world. The comments list the coordinates. Ball: a
  // point of A stays on a point of B, and A turns freely about it.
  Index add_ball_joint(Reference a, Reference b, const NewJoint& joint) { return add("ball", a, b, joint); }
  // Angle about the axis (rad).
  Index add_revolute_joint(Reference a, Reference b, const NewJoint& joint) {
    return add("revolute", a, b, joint);
  }
  // Displacement along the axis (m).
  Index add_prismatic_joint(Reference a, Reference b, const NewJoint& joint) {
    return add("prismatic", a, b, joint);
  }
  // Displacement along the axis (m), angle about it (rad).
  Index add_cylindrical_joint(Reference a, Reference b, const NewJoint& joint) {
    return add("cylindrical", a, b, joint);
  }
  // Angles about axis, fixed in B, and about axis_2, fixed in A (rad). They may not be parallel.
  Index add_universal_joint(Reference a, Reference b, const NewJoint& joint) {
    return add("universal", a, b, joint);
  }
  // Two displacements in the plane normal to the axis (m), angle about the axis (rad).
  Index add_planar_joint(Reference a, Reference b, const NewJoint& joint) {
    return add("planar", a, b, joint);
  }
  Index add_fixed_joint(Reference a, Reference b, const NewJoint& joint = {}) {
    return add("fixed", a, b, joint);
  }
  // Displacement along the axis (m): a point of A stays on a line of B, and A turns freely about it.
  Index add_point_on_line_joint(Reference a, Reference b, const NewJoint& joint) {
    return add("point_on_line", a, b, joint);
  }
  Index add_distance_joint(Reference a, Reference b, const NewRod& rod);

  // Excludes contacts between two bodies.
  void exclude(Reference a, Reference b);

  // Parts that were added, for changes; references hold until the next call that adds to the same list.
  Body& body(Reference body) { return d_.bodies[body.among(d_.bodies, "body")]; }
  Geom& geom(Reference geom) { return d_.geoms[geom.among(d_.geoms, "geom")]; }
  Joint& joint(Reference joint) { return d_.joints[joint.among(d_.joints, "joint")]; }
  // The whole description: gravity, tendons, actuators and so on.
  ModelDescription& description() { return d_; }

  // The builder can continue and build again.
  Model build() const { return Model(d_); }

 private:
  Index add(const char* kind, Reference a, Reference b, const NewJoint& given);
  JointEnd end(Reference body, const std::string& joint) const;

  ModelDescription d_;
};

}  // namespace amontons
