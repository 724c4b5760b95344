#pragma once
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

// Extent (m) of a convex shape from a point along a unit direction: the largest <direction, p - from> over
// all its points p; negative if the shape is wholly behind. Its rounding is that of the shape's distance from
// `from`. Not for static-only shapes.
double extent_along(const Shape& shape, const Transform& frame, const Vec3& direction, const Vec3& from);

// Whether a flat face of a convex shape supports it along a unit direction: the face normal must be within 18
// degrees of the direction. Not for static-only shapes.
bool has_face(const Shape& shape, const Transform& frame, const Vec3& direction);

// Whether a point of a shape of any kind, including its inside, is within a distance of a given point.
bool is_near(const Shape& shape, const Transform& frame, const Vec3& point, double distance);

// Whether a triangle of a mesh or height field within `distance` of a point has the given unit normal, to
// 1e-4 rad.
bool has_triangle(const Shape& surface, const Transform& frame, const Vec3& normal, const Vec3& point,
                  double distance);

}  // namespace amontons
