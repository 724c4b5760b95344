#pragma once
#include <cstdint>

#include "amontons/collision/shapes/shapes.hpp"

// A convex body as the narrow phase sees it. Everything in this room is relative to the sizes of the bodies:
// a scene in millimetres gives the same as one in kilometres.
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
  double extent = 0;  // about the radius of the core: what tolerances are relative to
  const ConvexHull* hull = nullptr;
  Vec3 corner[3];  // triangle: counter-clockwise seen from outside
};

// The "common coordinates" are axes of the world with an origin near the contact; both bodies of a pair have
// the same. The shape with the origin of the common coordinates moved to `origin` (choose it near the
// contact: rounding grows with the distance from it). Not for planes, meshes and height fields. A hull's data
// must outlive it.
Convex make_convex(const Shape& shape, const Transform& frame, const Vec3& origin);
Convex make_triangle(const Vec3& a, const Vec3& b, const Vec3& c);

// A point of the core that is extreme along `direction` (of any length but zero): one p with the largest
// <direction, p>. This support function is all that GJK and EPA know of a shape.
Vec3 support(const Convex& body, const Vec3& direction);

// Directions between the coordinates of a body's own axes and the common ones.
inline Vec3 to_local(const Convex& body, const Vec3& v) {
  return {dot(body.axis[0], v), dot(body.axis[1], v), dot(body.axis[2], v)};
}
inline Vec3 to_common(const Convex& body, const Vec3& v) {
  return v.x * body.axis[0] + v.y * body.axis[1] + v.z * body.axis[2];
}

// Of a hull: the corner that is extreme along a direction in its own frame, and where a corner is.
std::int32_t extreme_corner(const ConvexHull& hull, const Vec3& direction);
inline Vec3 corner_of(const Convex& body, std::int32_t i) {
  return body.centre + to_common(body, body.hull->vertices[i]);
}

// How the sizes of two bodies enter tolerances, in m: `size` is the smaller body's, `reach` bounds the
// coordinates and with them rounding.
struct PairScale {
  double size, reach;
};
PairScale pair_scale(const Convex& a, const Convex& b);

// The distance of two bodies, radii included, or how deep they overlap. separation.hpp finds it.
struct Separation {
  bool within = false;  // false: farther apart than the limit, the rest is not set
  double distance = 0;  // negative: the depth of the overlap along the shortest way out
  Vec3 normal;          // unit, from b to a
  Vec3 on_a, on_b;      // the closest points (deepest, for an overlap) of the surfaces
};

}  // namespace amontons::collision
