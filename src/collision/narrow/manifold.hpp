#pragma once
#include <cmath>
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"
#include "collision/narrow/feature.hpp"

// Complete contact manifolds of two bodies, and what clipping by hand needs for it (pairs/boxes.cpp). A
// manifold is complete if no corner of the common area is missing: forces at its points then reach every
// pressure that the area could carry, so that bodies at rest stay at rest, and no point has to be remembered
// between calls.
namespace amontons::collision {

// A point over a plane: its coordinates there and its height along the normal, m. Clipping works in the plane
// and carries the heights along.
struct Lifted {
  double u, v, height;
};

// The point at the part t of the way from p to q.
inline Lifted lerp(const Lifted& p, const Lifted& q, double t) {
  return {p.u + t * (q.u - p.u), p.v + t * (q.v - p.v), p.height + t * (q.height - p.height)};
}

// Whether two points fall together, seen along the normal.
inline bool is_near(const Lifted& p, const Lifted& q, double distance) {
  return std::abs(p.u - q.u) <= distance && std::abs(p.v - q.v) <= distance;
}

// Removes the corners of a polygon that lie within `merge` of the line through their neighbours, between
// them. Returns how many are left. Why: edges of two faces that nearly fall together cross in a point that is
// no corner of what the faces share, and that comes and goes with the last bits of the poses.
int drop_between(Lifted* corner, int count, double merge);

// Appends the contact points with gap <= margin of the supporting features along a given unit normal
// from b to a; `deepest` (or null) only helps to choose the faces. Returns the smallest gap,
// infinity if no point was found.
double clip_features(const Convex& a, const Convex& b, const Vec3& normal, const Separation* deepest,
                     double margin, std::vector<ContactPoint>& points);

// Appends the manifold of two bodies whose separation is known: clips the features along the normal of the
// best aligned face, or else along the separation's own; the deepest point is always there.
void manifold(const Convex& a, const Convex& b, const Separation& deepest, double margin,
              std::vector<ContactPoint>& points);

}  // namespace amontons::collision
