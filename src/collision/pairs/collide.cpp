#include "amontons/collision/pairs/collide.hpp"

#include <array>
#include <cstddef>

#include "collision/narrow/gjk.hpp"
#include "collision/pairs/height_field.hpp"
#include "collision/pairs/mesh.hpp"
#include "collision/pairs/pairs.hpp"

namespace amontons {

namespace collision {

void collide_convex(const Shape& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
                    double margin, std::vector<ContactPoint>& points) {
  const Convex body_a = make_convex(a, frame_a, frame_a.position),
               body_b = make_convex(b, frame_b, frame_a.position);
  const Separation s = separation(body_a, body_b, margin);
  if (!s.within) return;
  const std::size_t before = points.size();
  manifold(body_a, body_b, s, margin, points);
  for (std::size_t i = before; i < points.size(); ++i) points[i].point += frame_a.position;
}

namespace {

// Every pair is treated in one order, so that swapping the shapes cannot change the result. By shape first:
// the one whose surface decides comes second.
int rank(const Shape& shape) {
  // Sphere, Box, Capsule, Cylinder, Ellipsoid, Plane, Hull, Mesh, HeightField
  constexpr std::array<int, 9> order{0, 2, 1, 3, 4, 6, 5, 7, 8};
  return order[shape.index()];
}

bool comes_after(const Transform& a, const Transform& b) {
  const Vec3 &p = a.position, &q = b.position;
  if (p.x != q.x) return p.x > q.x;
  if (p.y != q.y) return p.y > q.y;
  if (p.z != q.z) return p.z > q.z;
  const Quat &r = a.rotation, &s = b.rotation;
  if (r.w != s.w) return r.w > s.w;
  if (r.x != s.x) return r.x > s.x;
  if (r.y != s.y) return r.y > s.y;
  return r.z > s.z;
}

void collide_in_order(const Shape& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
                      double margin, std::vector<ContactPoint>& points) {
  if (std::holds_alternative<Plane>(b)) return collide_plane(a, frame_a, frame_b, margin, points);
  if (const auto* mesh = std::get_if<Mesh>(&b))
    return collide_mesh(*mesh->data, frame_b, a, frame_a, margin, points);
  if (const auto* field = std::get_if<HeightField>(&b))
    return collide_height_field(*field->data, frame_b, a, frame_a, margin, points);
  if (const auto* sphere = std::get_if<Sphere>(&a); sphere && !std::holds_alternative<Hull>(b))
    return collide_sphere(*sphere, frame_a, b, frame_b, margin, points);
  if (const auto *p = std::get_if<Capsule>(&a), *q = std::get_if<Capsule>(&b); p && q)
    return collide_capsules(*p, frame_a, *q, frame_b, margin, points);
  if (const auto *p = std::get_if<Box>(&a), *q = std::get_if<Box>(&b); p && q)
    return collide_boxes(*p, frame_a, *q, frame_b, margin, points);
  collide_convex(a, frame_a, b, frame_b, margin, points);
}

}  // namespace

}  // namespace collision

void collide(const Shape& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
             double margin, std::vector<ContactPoint>& points) {
  const int rank_a = collision::rank(a), rank_b = collision::rank(b);
  const int first_static = collision::rank(Plane{});
  if (rank_a >= first_static && rank_b >= first_static) return;
  const bool swap = rank_a != rank_b ? rank_a > rank_b : collision::comes_after(frame_a, frame_b);
  if (!swap) return collision::collide_in_order(a, frame_a, b, frame_b, margin, points);
  const std::size_t before = points.size();
  collision::collide_in_order(b, frame_b, a, frame_a, margin, points);
  for (std::size_t i = before; i < points.size(); ++i) points[i].normal = -points[i].normal;
}

}  // namespace amontons
