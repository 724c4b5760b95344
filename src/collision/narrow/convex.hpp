#pragma once
#include <cstdint>

#include "amontons/collision/shapes/shapes.hpp"

// A convex body for the narrow phase. All quantities in this room are relative to the sizes of the bodies: a
// scene in millimetres gives the same as one in kilometres.
namespace amontons::collision {

// A convex body in the coordinates of the narrow phase: the points within `radius` of its core. Spheres are
// points and capsules segments with a radius; all other bodies have radius 0.
struct Convex {
  enum class Kind : unsigned char { point, segment, triangle, box, cylinder, ellipsoid, hull };
  Kind kind;
  Vec3 centre;
  Vec3 axis[3];  // columns of its rotation: the body's axes in the common coordinates
  // box: half edges; ellipsoid: semi-axes; segment: z is the half length; cylinder: x the radius, z the half
  // length.
  Vec3 size;
  double radius = 0;
  double extent = 0;  // about the radius of the core; tolerances are relative to it
  const ConvexHull* hull = nullptr;
  Vec3 corner[3];  // triangle: counter-clockwise seen from outside
};

// The "common coordinates" are axes of the world with an origin near the contact, shared by both bodies of a
// pair. Makes the shape with the origin of the common coordinates at `origin` (near the contact, because
// rounding grows with the distance from it). Not for planes, meshes and height fields. A hull's data must
// outlive it.
Convex make_convex(const Shape& shape, const Transform& frame, const Vec3& origin);
Convex make_triangle(const Vec3& a, const Vec3& b, const Vec3& c);

// A point of the core that is extreme along `direction` (of any nonzero length): a p with the largest
// <direction, p>. GJK and EPA use only this function of a shape.
Vec3 support(const Convex& body, const Vec3& direction);

// Directions between the coordinates of a body's own axes and the common ones.
inline Vec3 to_local(const Convex& body, const Vec3& v) {
  return {dot(body.axis[0], v), dot(body.axis[1], v), dot(body.axis[2], v)};
}
inline Vec3 to_common(const Convex& body, const Vec3& v) {
  return v.x * body.axis[0] + v.y * body.axis[1] + v.z * body.axis[2];
}

// For a hull: the place of a corner.
inline Vec3 corner_of(const Convex& body, std::int32_t i) {
  return body.centre + to_common(body, body.hull->vertices[i]);
}

// Sizes of two bodies for tolerances (m): `size` is the smaller body's, `reach` bounds the coordinates and so
// the rounding.
struct PairScale {
  double size, reach;
};
PairScale pair_scale(const Convex& a, const Convex& b);

// The distance of two bodies, radii included, or their depth of overlap. separation.hpp computes it.
struct Separation {
  bool within = false;  // false: the distance exceeds the limit, other members are not set
  double distance = 0;  // negative: depth of the overlap in the direction of least penetration
  Vec3 normal;          // unit, from b to a
  Vec3 on_a, on_b;      // the closest points (deepest, for an overlap) of the surfaces
};

}  // namespace amontons::collision
