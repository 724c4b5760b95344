#pragma once
#include <variant>

#include "amontons/collision/shapes/height_field.hpp"
#include "amontons/collision/shapes/hull.hpp"
#include "amontons/collision/shapes/mesh.hpp"

// The shapes that a few lengths describe stand here, those with data of their own in the headers above. Each
// is given in a frame of its own, for the primitives with their centre at the origin; lengths are in m.
// A shape is plain data without a mass: the pose comes with every question asked about it.
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

// Any shape: the convex ones, then from Plane on those that are static only. Of the two shapes of a pair the
// one that comes first here is treated as the first (pairs/collide.cpp).
using Shape = std::variant<Sphere, Capsule, Box, Cylinder, Ellipsoid, Hull, Plane, Mesh, HeightField>;

// Throws InputError naming what is wrong: sizes that are not positive and finite, shapes without data.
void validate(const Shape& shape);

// Only fixed bodies may carry these: planes, meshes and height fields. All others are convex.
bool is_static_only(const Shape& shape);
// The radius of the sphere about the origin of the shape that holds it; infinite for a plane.
double bounding_radius(const Shape& shape);
// The axis-aligned box around the shape in world coordinates; infinite for a plane. `frame` takes coordinates
// of the shape into the world. For meshes and height fields it is the box around their own box, turned.
Aabb bounds(const Shape& shape, const Transform& frame);
// A box around the shape that is as tight as can be had without looking at its corners, of which hulls of
// scanned parts have hundreds: for hulls, too, the box around their own box.
Aabb quick_bounds(const Shape& shape, const Transform& frame);

}  // namespace amontons
