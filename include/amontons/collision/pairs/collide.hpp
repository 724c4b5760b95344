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

}  // namespace amontons
