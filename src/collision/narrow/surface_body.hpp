#pragma once
#include <algorithm>

#include "collision/narrow/feature.hpp"
#include "collision/shapes/facet.hpp"

namespace amontons::collision {

// A convex body over a static surface, in the coordinates of the surface with the origin moved to the body,
// where rounding is least.
struct SurfaceBody {
  Convex convex;
  Aabb local;     // the box around it along its own axes
  Vec3 inside;    // a point inside it
  Vec3 origin;    // of these coordinates, in those of the surface
  Aabb box;       // around it and its margin, in the coordinates of the surface
  double margin;  // up to which gaps count

  // `frame`: of the shape, in the coordinates of the surface.
  SurfaceBody(const Shape& shape, const Transform& frame, double margin);

  double size() const { return convex.extent + convex.radius; }
  // Points as near to a plane as this are on both its sides, so that none is lost between two triangles.
  double tolerance() const { return 1e-9 * size(); }
  // The point of it that is lowest over a plane with the normal n.
  Vec3 lowest_along(const Vec3& n) const { return support(convex, -n) - convex.radius * n; }

  // Most triangles near a slanting body are out of its reach: a cheap test before the others.
  bool is_in_reach(const Facet& facet, double reach) const {
    bool yes = true;
    for (int k = 0; k < 3; ++k) {
      const double a = dot(convex.axis[k], facet.corner[0]), b = dot(convex.axis[k], facet.corner[1]),
                   c = dot(convex.axis[k], facet.corner[2]);
      yes = yes && std::min({a, b, c}) <= local.upper[k] + reach &&
            std::max({a, b, c}) >= local.lower[k] - reach;
    }
    return yes;
  }

  // Whether a point lies between the planes that stand on the edges of a facet.
  bool is_over(const Facet& facet, const Vec3& p) const {
    bool yes = true;
    for (int k = 0; k < 3; ++k) yes = yes && dot(inward_of(facet, k), p - facet.corner[k]) >= -tolerance();
    return yes;
  }

  // What the body turns to a face. Kept for the next face: on flat ground all have the same normal.
  const Feature& feature_towards(const Vec3& n, const Vec3& lowest) {
    if (!(n == feature_normal_)) supporting_feature(convex, -n, &lowest, nullptr, feature_);
    feature_normal_ = n;
    return feature_;
  }

 private:
  Feature feature_;
  Vec3 feature_normal_;  // that feature_ belongs to
};

}  // namespace amontons::collision
