#pragma once
#include <vector>

#include "amontons/collision/pairs/collide.hpp"
#include "amontons/collision/shapes/shapes.hpp"

// What the narrow phase knows of convex bodies: support functions, supporting features, distance and
// penetration of two of them, and contact manifolds by clipping. Everything is relative to the sizes of the
// bodies: a scene in millimetres gives the same as one in kilometres.
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

// The shape with the origin of the common coordinates moved to `origin` (choose it near the contact: rounding
// grows with the distance from it). Not for planes, meshes and height fields. A hull's data must outlive it.
Convex make_convex(const Shape& shape, const Transform& frame, const Vec3& origin);
Convex make_triangle(const Vec3& a, const Vec3& b, const Vec3& c);

// A point of the core that is extreme along `direction` (of any length but zero).
Vec3 support(const Convex& body, const Vec3& direction);

// The feature of a body (radius included) that supports it along a unit direction: a face whose normal is
// close to the direction, an edge that is nearly perpendicular to it, or the extreme point.
struct Feature {
  static constexpr int capacity = 64;  // faces with more corners are thinned out
  int count = 0;                       // 1: a point, 2: an edge, 3 and more: a flat face
  Vec3 normal;                         // of a face, unit, outwards
  Vec3 points[capacity];               // faces: counter-clockwise seen from outside
};
// `through` (a point on the body's surface, or null): of several faces choose one that holds this point, so
// that the contact's deepest point is never missed. `phase`: the direction of the first corner of a round cap
// (null: fixed in the body).
void supporting_feature(const Convex& body, const Vec3& direction, const Vec3* through, const Vec3* phase,
                        Feature& feature);

// The distance of two bodies, radii included, or how deep they overlap.
struct Separation {
  bool within = false;  // false: farther apart than the limit, the rest is not set
  double distance = 0;  // negative: the depth of the overlap along the shortest way out
  Vec3 normal;          // unit, from b to a
  Vec3 on_a, on_b;      // the closest points (deepest, for an overlap) of the surfaces
};
// By GJK between the cores, by EPA where those touch or overlap.
Separation separation(const Convex& a, const Convex& b, double limit);

// Appends the contact points with gap <= margin of the supporting features along a given unit normal from b
// to a; `deepest` (or null) only helps to choose the faces. Returns the smallest gap, infinity if no point
// was found.
double clip_features(const Convex& a, const Convex& b, const Vec3& normal, const Separation* deepest,
                     double margin, std::vector<ContactPoint>& points);

// Appends the manifold of two bodies whose separation is known: clips the features along the normal of the
// best aligned face, or else along the separation's own; the deepest point is always there.
void manifold(const Convex& a, const Convex& b, const Separation& deepest, double margin,
              std::vector<ContactPoint>& points);

}  // namespace amontons::collision
