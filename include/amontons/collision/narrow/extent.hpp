#pragma once
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

// How far a convex shape reaches from a point along a unit direction (m): the largest <direction, p - from>
// over all its points p; negative if it lies wholly behind. Rounding is that of the shape's distance from
// `from`. Not for shapes that are static only.
double extent_along(const Shape& shape, const Transform& frame, const Vec3& direction, const Vec3& from);

// Whether a flat face of a convex shape supports it along a unit direction: one whose normal is within 18
// degrees of it. Not for shapes that are static only.
bool has_face(const Shape& shape, const Transform& frame, const Vec3& direction);

// Whether some point of a shape of any kind, or of its inside where it has one, is within a distance of a
// point.
bool is_near(const Shape& shape, const Transform& frame, const Vec3& point, double distance);

// Whether a triangle of a mesh or a height field within `distance` of a point has a unit normal, to 1e-4 rad.
bool has_triangle(const Shape& surface, const Transform& frame, const Vec3& normal, const Vec3& point,
                  double distance);

}  // namespace amontons
