#pragma once
#include <variant>

#include "amontons/collision/shapes/height_field.hpp"
#include "amontons/collision/shapes/hull.hpp"
#include "amontons/collision/shapes/mesh.hpp"

// Shapes with a few lengths are defined here, those with data of their own in the headers above. Each is
// given in a frame of its own; primitives have their centre at the origin. Lengths are in m. A shape is plain
// data without a mass; functions take its pose as an argument.
namespace amontons {

struct Sphere {
  double radius;
};
struct Capsule {  // the points within `radius` of the segment |z| <= half_length
  double radius, half_length;
};
struct Box {
  Vec3 half;  // half edge lengths
};
struct Cylinder {  // about the z axis, |z| <= half_length
  double radius, half_length;
};
struct Ellipsoid {
  Vec3 radii;  // semi-axes along x, y, z
};
struct Plane {};  // the half space z <= 0; its normal is +z. Static.

// Any shape: the convex ones, then from Plane on those that are static only. The shape of a pair that comes
// first here is treated as the first (pairs/collide.cpp).
using Shape = std::variant<Sphere, Capsule, Box, Cylinder, Ellipsoid, Hull, Plane, Mesh, HeightField>;

// Throws InputError naming the error: sizes that are not positive and finite, shapes without data.
void validate(const Shape& shape);

// Only fixed and kinematic bodies may have these: planes, meshes and height fields. All others are convex.
bool is_static_only(const Shape& shape);
// The radius of the sphere about the origin of the shape that contains it; infinite for a plane.
double bounding_radius(const Shape& shape);
// The axis-aligned box around the shape in world coordinates; infinite for a plane. `frame` transforms
// coordinates of the shape to the world. For meshes and height fields it is the box around their own turned
// box.
Aabb bounds(const Shape& shape, const Transform& frame);
// The tightest box around the shape that can be found without its corners, of which hulls of scanned parts
// have hundreds: for hulls also the box around their own box.
Aabb quick_bounds(const Shape& shape, const Transform& frame);

}  // namespace amontons
