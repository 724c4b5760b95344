#pragma once
#include "amontons/collision/shapes/aabb.hpp"

// The shapes that a few lengths describe, each in its own frame with its centre at the origin; lengths in m.
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

// What every shape answers for itself; shapes.hpp asks the one that a Shape holds.
namespace collision {

// Throws InputError naming the size that is not positive and finite.
void require_valid(const Sphere& shape);
void require_valid(const Capsule& shape);
void require_valid(const Box& shape);
void require_valid(const Cylinder& shape);
void require_valid(const Ellipsoid& shape);
void require_valid(const Plane& shape);

// The radius of the sphere about the origin of the shape that holds it.
double radius_about_origin(const Sphere& shape);
double radius_about_origin(const Capsule& shape);
double radius_about_origin(const Box& shape);
double radius_about_origin(const Cylinder& shape);
double radius_about_origin(const Ellipsoid& shape);
double radius_about_origin(const Plane& shape);

// The axis-aligned box around the shape in world coordinates.
Aabb box_around(const Sphere& shape, const Transform& frame);
Aabb box_around(const Capsule& shape, const Transform& frame);
Aabb box_around(const Box& shape, const Transform& frame);
Aabb box_around(const Cylinder& shape, const Transform& frame);
Aabb box_around(const Ellipsoid& shape, const Transform& frame);
Aabb box_around(const Plane& shape, const Transform& frame);

// The same for all that lies within a box of the shape's own frame.
double radius_about_origin(const Aabb& local);
Aabb box_around(const Aabb& local, const Transform& frame);

}  // namespace collision
}  // namespace amontons
