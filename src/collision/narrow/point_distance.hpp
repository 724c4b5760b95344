#pragma once
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons::collision {

// A point of a surface near a given point: at `distance` from it (negative inside) against `normal`.
struct SurfaceDistance {
  double distance;
  Vec3 normal;  // unit, outwards
};

// The distance of a point in the shape's own frame; for spheres, capsules, boxes, cylinders and ellipsoids.
SurfaceDistance distance_to(const Shape& shape, const Vec3& point);

}  // namespace amontons::collision
