#pragma once
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

// Appends the contact points of two shapes whose gap is at most `margin` (>= 0, m): complete manifolds, that
// is the corners of the common face for two flat faces. Swapping A and B only mirrors the normals. The frames
// transform coordinates of the shapes to the world; their rotations are unit quaternions. Deterministic: the
// order of the points depends only on shapes and poses. Pairs of two static-only shapes have no points.
void collide(const Shape& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
             double margin, std::vector<ContactPoint>& points);

// The same for two convex shapes along a given unit normal from B to A, which need not be the direction of
// shortest distance. The feature of A against the normal is clipped by the feature of B along it, so that
// only the part of A over a face of B has points.
void collide_along(const Vec3& normal, const collision::Posed& a, const collision::Posed& b, double margin,
                   std::vector<ContactPoint>& points);

}  // namespace amontons
