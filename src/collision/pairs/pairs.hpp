#pragma once
#include <vector>

#include "amontons/collision/pairs/collide.hpp"

// The pairs that have a way of their own. The normal points from the second shape to the first.
namespace amontons::collision {

// A point of a surface near a given point: at `distance` from it (negative inside) against `normal`.
struct SurfaceDistance {
  double distance;
  Vec3 normal;  // unit, outwards
};

// The distance of a point in the shape's own frame; for spheres, capsules, boxes, cylinders and ellipsoids.
SurfaceDistance distance_to(const Shape& shape, const Vec3& point);

void collide_sphere(const Sphere& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
                    double margin, std::vector<ContactPoint>& points);
void collide_capsules(const Capsule& a, const Transform& frame_a, const Capsule& b, const Transform& frame_b,
                      double margin, std::vector<ContactPoint>& points);
void collide_boxes(const Box& a, const Transform& frame_a, const Box& b, const Transform& frame_b,
                   double margin, std::vector<ContactPoint>& points);
// Any convex shape on a plane: every corner of the side turned to the plane.
void collide_plane(const Shape& a, const Transform& frame_a, const Transform& plane, double margin,
                   std::vector<ContactPoint>& points);
// By distance, penetration and clipping; for all convex shapes.
void collide_convex(const Shape& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
                    double margin, std::vector<ContactPoint>& points);

}  // namespace amontons::collision
