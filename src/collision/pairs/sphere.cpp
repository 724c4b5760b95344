#include "collision/pairs/sphere.hpp"

#include "collision/narrow/point_distance.hpp"

namespace amontons::collision {

// The gap is the distance of the sphere's centre from the surface less the radius, along that surface's
// normal.
void collide_sphere(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const double radius = std::get<Sphere>(a.shape).radius;
  const Vec3 offset = a.frame.position - b.frame.position;
  const SurfaceDistance d = distance_to(b.shape, rotate(conjugate(b.frame.rotation), offset));
  const double gap = d.distance - radius;
  if (!(gap <= margin)) return;
  const Vec3 n = rotate(b.frame.rotation, d.normal);
  points.push_back({a.frame.position - (radius + 0.5 * gap) * n, n, gap});
}

}  // namespace amontons::collision
