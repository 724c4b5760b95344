#include "amontons/multibody/kinematics/rays.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

namespace {

// Whether the ray passes within `radius` of a point, before `distance`.
bool comes_near(const Ray& ray, const Vec3& centre, double radius, double distance) {
  const Vec3 to = centre - ray.origin;
  const double along = dot(to, ray.direction);
  const double beside = norm_squared(to - along * ray.direction);
  return beside <= radius * radius && along + radius >= 0 && along - radius <= distance;
}

}  // namespace

// Tests geoms one by one, skipping those whose bounding sphere the ray misses. One ray costs less than the
// broad phase of a step.
GeomHit cast_ray(const Model& model, const State& state, const Ray& ray,
                 std::span<const unsigned char> excluded) {
  GeomHit nearest;
  const auto& geoms = model.description().geoms;
  for (std::size_t g = 0; g < geoms.size(); ++g) {
    const Geom& geom = geoms[g];
    if (excluded[g]) continue;
    const Transform frame = pose_in(state, geom.body) * geom.frame;
    // Slightly larger, so that rounding loses no grazing ray.
    const double radius = bounding_radius(geom.shape) * (1 + 1e-9);
    if (std::isfinite(radius) && !comes_near(ray, frame.position, radius, nearest.hit.distance)) continue;
    const RayHit hit = cast_ray(geom.shape, frame, ray);
    if (hit.distance < nearest.hit.distance) nearest = {hit, static_cast<Index>(g)};
  }
  return nearest;
}

}  // namespace amontons
