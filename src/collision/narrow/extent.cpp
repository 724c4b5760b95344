#include "amontons/collision/narrow/extent.hpp"

#include "collision/narrow/convex.hpp"
#include "collision/narrow/feature.hpp"
#include "collision/narrow/separation.hpp"
#include "collision/shapes/height_grid.hpp"
#include "collision/shapes/triangle_mesh.hpp"

namespace amontons {

// The support function with `from` as origin; the radius of a core adds the same in every direction.
double extent_along(const Shape& shape, const Transform& frame, const Vec3& direction, const Vec3& from) {
  const collision::Convex body = collision::make_convex(shape, frame, from);
  return dot(direction, collision::support(body, direction)) + body.radius;
}

bool has_face(const Shape& shape, const Transform& frame, const Vec3& direction) {
  thread_local collision::Feature feature;
  const collision::Convex body = collision::make_convex(shape, frame, frame.position);
  collision::supporting_feature(body, direction, nullptr, nullptr, feature);
  return feature.count > 2;
}

namespace {

// Calls visit(triangle) for the triangles within a distance of a point, in the coordinates of the surface;
// for other shapes it makes no call.
void for_each_triangle_near(const Shape& surface, const Vec3& point, double distance, auto&& visit) {
  const Vec3 reach{distance, distance, distance};
  const auto search = [&](const auto& triangles) {
    triangles.for_each_near(Aabb{point - reach, point + reach}, [&](auto triangle) {
      const collision::Facet facet = triangles.facet(triangle);
      if (norm(collision::closest_point(facet.corner, point).at - point) <= distance) visit(facet);
    });
  };
  if (const auto* mesh = std::get_if<Mesh>(&surface)) search(collision::MeshSurface{*mesh->data});
  if (const auto* field = std::get_if<HeightField>(&surface)) search(collision::GridSurface{*field->data});
}

}  // namespace

bool is_near(const Shape& shape, const Transform& frame, const Vec3& point, double distance) {
  if (!is_static_only(shape)) {
    const collision::Convex at = collision::make_convex(Sphere{0}, {point, {}}, point);
    return collision::separation(at, collision::make_convex(shape, frame, point), distance).within;
  }
  const Vec3 local = inverse(frame)(point);
  if (std::holds_alternative<Plane>(shape)) return local.z <= distance;
  bool found = false;
  for_each_triangle_near(shape, local, distance, [&](const collision::Facet&) { found = true; });
  return found;
}

bool has_triangle(const Shape& surface, const Transform& frame, const Vec3& normal, const Vec3& point,
                  double distance) {
  const Transform to_local = inverse(frame);
  const Vec3 n = rotate(to_local.rotation, normal);
  bool found = false;
  for_each_triangle_near(surface, to_local(point), distance, [&](const collision::Facet& facet) {
    found = found || norm(facet.normal - n) <= collision::flat_angle;
  });
  return found;
}

}  // namespace amontons
