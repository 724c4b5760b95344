#pragma once
#include <cmath>
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"
#include "collision/narrow/feature.hpp"

// Complete contact manifolds of two bodies, and the parts that explicit clipping needs (pairs/boxes.cpp). A
// manifold is complete if it contains every corner of the common area. Forces at its points can then
// represent every pressure on the area, so that bodies at rest stay at rest, and no point has to be stored
// between calls.
namespace amontons::collision {

// A point over a plane: its coordinates there and its height along the normal, m. Clipping works in the plane
// and interpolates the heights.
struct Lifted {
  double u, v, height;
};

// The point at the fraction t from p to q.
inline Lifted lerp(const Lifted& p, const Lifted& q, double t) {
  return {p.u + t * (q.u - p.u), p.v + t * (q.v - p.v), p.height + t * (q.height - p.height)};
}

// Whether two points coincide, seen along the normal.
inline bool is_near(const Lifted& p, const Lifted& q, double distance) {
  return std::abs(p.u - q.u) <= distance && std::abs(p.v - q.v) <= distance;
}

// Removes the corners of a polygon that are within `merge` of the line through their neighbours, between
// them. Returns the number that remains. Reason: edges of two faces that nearly coincide cross in a point
// that is no corner of the common face and that depends on the last bits of the poses.
int drop_between(Lifted* corner, int count, double merge);

// Appends the contact points with gap <= margin of the supporting features along a given unit normal from b
// to a. `deepest` (or null) only affects the choice of faces. Returns the smallest gap, infinity without
// points.
double clip_features(const Convex& a, const Convex& b, const Vec3& normal, const Separation* deepest,
                     double margin, std::vector<ContactPoint>& points);

// Appends the manifold of two bodies with known separation: clips the features along the normal of the best
// aligned face, otherwise along that of the separation. The deepest point is always included.
void manifold(const Convex& a, const Convex& b, const Separation& deepest, double margin,
              std::vector<ContactPoint>& points);

}  // namespace amontons::collision
