#pragma once
#include <limits>

#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

// The points origin + t direction, t >= 0; the direction is a unit vector.
struct Ray {
  Vec3 origin, direction;
};
// The first point at which a ray passes the surface of a shape; infinite distance if there is none.
struct RayHit {
  double distance = std::numeric_limits<double>::infinity();
  Vec3 normal;  // of the surface at the hit, unit, outwards
};

// In the frame of the shape. A ray from inside a shape hits the surface where it leaves. Planes are hit from
// above only, meshes and height fields from both sides.
RayHit cast_ray(const Shape& shape, const Ray& ray);
// The shape in its pose, the ray and its hit in the world.
RayHit cast_ray(const Shape& shape, const Transform& frame, const Ray& ray);

}  // namespace amontons
