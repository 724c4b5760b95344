#pragma once
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"
#include "collision/narrow/feature.hpp"

namespace amontons::collision {

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
