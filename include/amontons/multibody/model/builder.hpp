#pragma once
#include <optional>
#include <string>

#include "amontons/multibody/model/model.hpp"

namespace amontons {

// What a new body is, beside its name.
struct NewBody {
  // Of the body frame in the world: m, unit quaternion.
  Vec3 position{};
  Quat orientation{};
  // Carried at the origin of the body frame, with `material`; more by add_geom.
  std::optional<Shape> shape{};
  // Of a dynamic body: density (kg/m^3) of the shape; or mass (kg), and inertia (kg m^2, about the centre of
  // mass, body axes) unless the shape says it. A body without any gets its mass from geoms with a density.
  double density = 0, mass = 0;
  std::optional<Mat3> inertia{};
  std::optional<Vec3> centre_of_mass{};  // m, body frame
  Motion motion = Motion::dynamic;
  Vec3 linear_velocity{}, angular_velocity{};  // initial, of the frame's origin, world axes, m/s, rad/s
  double gravity_scale = 1;
  Material material{};
  Vec3 friction_direction{};  // as of a Geom
};

// What a new shape on a body is. `density` (kg/m^3) adds its mass to the body; with 0 it has none.
struct NewGeom {
  std::string name{};
  Vec3 position{};  // of the shape in the body frame, m
  Quat orientation{};
  Material material{};
  double density = 0;
  Vec3 surface_velocity{}, surface_spin{};  // these and what follows as of a Geom
  Vec3 friction_direction{};
  std::uint32_t category = 1, mask = 1;
};

// What a new joint is. Points (m) and axes (of any length but zero) are in the world at the initial poses of
// the bodies, where all coordinates are zero.
struct NewJoint {
  std::string name{};
  std::optional<Vec3> point{};  // without it the origin of A, where the joint may do without
  Vec3 axis{};                  // of a planar joint its normal
  Vec3 axis_2{};                // of a universal joint, what turns with A

  // Limits, spring, damper, friction, drive and motor of every degree of freedom, or of each; kind, axis and
  // anchor are the joint's own. A ball takes stiffness, damping, friction and armature, and `upper` as its
  // limit.
  Dof dof{};
  std::vector<Dof> dofs{};
  double compliance = 0;  // of the locked directions, m/N; 0 is rigid
  bool collide = false;   // whether the two bodies may touch each other
};

// What keeps the distance of a point of A and a point of B, initial and in the world: a rod, of `length` (m)
// or the initial distance; with limits a rope or a stop.
struct NewRod {
  std::string name{};
  Vec3 point_a{}, point_b{};
  std::optional<double> length{}, lower{}, upper{};
  double compliance = 0;
  bool collide = false;
};

// Makes the description of a model: what Python's ModelBuilder does, by the same arithmetic. Bodies are named
// by the index that add_body returns or by their name; "world" is the world. What has no function here is
// plain data in description(). Functions throw InputError naming the thing and the remedy, and then add
// nothing; build() checks the whole.
class ModelBuilder {
 public:
  ModelBuilder() = default;
  // Goes on from a description, as of a file.
  explicit ModelBuilder(ModelDescription description) : d_(std::move(description)) {}

  // Each returns the index of what it adds; an empty name leaves it to the index alone.
  Index add_body(const std::string& name, const NewBody& body = {});
  Index add_geom(Reference body, const Shape& shape, const NewGeom& geom = {});
  // A plane on the world at a height (m), which every shape touches that may touch anything.
  Index add_floor(double height = 0, const Material& material = {}, const std::string& name = "floor");

  // Every joint moves A relative to B; A may not be the world. Comments list the coordinates. A point of A
  // stays on a point of B, and A turns freely about it:
  Index add_ball_joint(Reference a, Reference b, const NewJoint& joint);
  // The angle about the axis, rad.
  Index add_revolute_joint(Reference a, Reference b, const NewJoint& joint);
  // The way along the axis, m.
  Index add_prismatic_joint(Reference a, Reference b, const NewJoint& joint);
  // Along the axis, m, and about it, rad.
  Index add_cylindrical_joint(Reference a, Reference b, const NewJoint& joint);
  // About axis, fixed in B, and about axis_2, fixed in A, rad: they may not be parallel.
  Index add_universal_joint(Reference a, Reference b, const NewJoint& joint);
  // In the plane across the axis, m and m, and about it, rad.
  Index add_planar_joint(Reference a, Reference b, const NewJoint& joint);
  Index add_fixed_joint(Reference a, Reference b, const NewJoint& joint = {});
  // Along the axis, m: a point of A stays on a line of B, and A turns freely about it.
  Index add_point_on_line_joint(Reference a, Reference b, const NewJoint& joint);
  Index add_distance_joint(Reference a, Reference b, const NewRod& rod);

  // Two bodies never touch.
  void exclude(Reference a, Reference b);

  // What was added, to change it; references hold until the next call adds to the same list.
  Body& body(Reference body) { return d_.bodies[body.among(d_.bodies, "body")]; }
  Geom& geom(Reference geom) { return d_.geoms[geom.among(d_.geoms, "geom")]; }
  Joint& joint(Reference joint) { return d_.joints[joint.among(d_.joints, "joint")]; }
  // All of it: gravity, tendons, actuators and the like.
  ModelDescription& description() { return d_; }

  // The builder can go on and build again.
  Model build() const { return Model(d_); }

 private:
  // The directions of a joint's degrees of freedom, in a frame of B that is turned by `rotation`.
  struct Way {
    Dof::Kind kind;
    Vec3 axis{0, 0, 1};
  };
  enum class Use : unsigned char { required, optional };
  Index add_chain(const char* kind, Reference a, Reference b, const NewJoint& given, Use point,
                  std::optional<Quat> rotation, std::initializer_list<Way> ways, bool spherical = false);
  Joint between(const std::string& who, const std::string& name, Reference a, Reference b) const;

  ModelDescription d_;
};

}  // namespace amontons
