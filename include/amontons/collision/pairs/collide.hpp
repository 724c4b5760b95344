#pragma once
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

// Appends the contact points of two shapes whose gap is at most `margin` (>= 0, m): complete manifolds, the
// corners of the common face for two flat faces. Swapping A and B mirrors the normals and nothing else.
// The frames take coordinates of the shapes into the world; their rotations are unit quaternions.
// Deterministic: the order of the points depends on the shapes and poses only.
// Pairs of two static-only shapes have no points.
void collide(const Shape& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
             double margin, std::vector<ContactPoint>& points);

// The same for two convex shapes along a given unit normal from B to A, which need not be the shortest way
// apart: what A turns against the normal is cut by what B turns along it, so that only the part of A over a
// face of B has points.
void collide_along(const Vec3& normal, const Shape& a, const Transform& frame_a, const Shape& b,
                   const Transform& frame_b, double margin, std::vector<ContactPoint>& points);

}  // namespace amontons
