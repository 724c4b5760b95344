#include "amontons/collision/rays/ray.hpp"
#include "check.hpp"
#include "collision/narrow/convex.hpp"
#include "collision_scenes.hpp"

// Rays against shapes, certified by support functions: no other implementation of the formulas.
using namespace scenes;

namespace {

// The largest <normal, p> over the shape.
double support_along(const Shape& shape, const Transform& frame, const Vec3& normal) {
  const collision::Convex body = collision::make_convex(shape, frame, {});
  return dot(collision::support(body, normal), normal) + body.radius;
}

}  // namespace

// Fails if a hit is not on the surface, its normal is not the one there, or another surface is nearer: of a
// convex body the tangent plane at the hit bounds all of it, and the ray comes in exactly where it goes
// against the normal of such a plane.
TEST(rays_hit_convex_shapes_where_tangent_planes_say) {
  Random random;
  const std::vector<Shape> shapes{Sphere{0.7},        Capsule{0.3, 0.5},          Box{{0.3, 0.5, 0.2}},
                                  Cylinder{0.4, 0.6}, Ellipsoid{{0.3, 0.6, 0.9}}, box_hull({0.4, 0.2, 0.6}),
                                  prism(7, 0.5, 0.3)};
  for (const Shape& shape : shapes)
    for (int trial = 0; trial < 400; ++trial) {
      const Transform frame{random.vector(), random.rotation()};
      // Through a point inside, from outside or from inside.
      const bool inside = trial % 4 == 0;
      const Vec3 target = frame.position + 0.1 * random.vector();
      const Vec3 direction = normalised(random.vector());
      const Vec3 origin = inside ? target : target - (2 + std::abs(random()) * 10) * direction;
      const RayHit hit = cast_ray(shape, frame, {origin, direction});
      CHECK(std::isfinite(hit.distance) && hit.distance >= 0);
      CHECK_NEAR(norm(hit.normal), 1, 1e-12);
      const Vec3 p = origin + hit.distance * direction;
      CHECK_NEAR(support_along(shape, frame, hit.normal), dot(hit.normal, p), 1e-12);
      CHECK((dot(hit.normal, direction) < 0) == !inside);
    }
}

// Fails if a ray behind, beside or from behind a shape hits it.
TEST(rays_miss_what_they_do_not_meet) {
  const Ray away{{2, 0, 0}, {1, 0, 0}}, beside{{-5, 1.01, 0}, {1, 0, 0}};
  for (const Shape& shape :
       {Shape{Sphere{1}}, Shape{Capsule{1, 0.5}}, Shape{Box{{1, 1, 1}}}, Shape{Cylinder{1, 1}},
        Shape{Ellipsoid{{1, 1, 1}}}, Shape{box_hull({1, 1, 1})}}) {
    CHECK(cast_ray(shape, away).distance == INFINITY);
    CHECK(cast_ray(shape, beside).distance == INFINITY);
  }
  CHECK(cast_ray(Plane{}, {{0, 0, 1}, {0, 0, 1}}).distance == INFINITY);
  CHECK(cast_ray(Plane{}, {{0, 0, 1}, {1, 0, 0}}).distance == INFINITY);
  CHECK(cast_ray(Plane{}, {{0, 0, 1}, {0.6, 0, -0.8}}).distance == 1.25);
}

// Fails if a ray slips between two triangles: through corners and edges, along lines of the grid and across.
TEST(rays_do_not_slip_through_surfaces) {
  Random random;
  const std::size_t rows = 7, columns = 9;
  std::vector<double> heights;
  for (std::size_t i = 0; i < rows * columns; ++i) heights.push_back(0.3 * random());
  const HeightField field = make_height_field(heights, rows, columns, 4, 3);
  std::vector<Vec3> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;
  for (int r = 0; r < 7; ++r)
    for (int c = 0; c < 9; ++c) {
      vertices.push_back({(c / 8.0 - 0.5) * 4, (r / 6.0 - 0.5) * 3, heights[9 * r + c]});
      if (r == 6 || c == 8) continue;
      const int a = 9 * r + c;
      triangles.push_back({a, a + 1, a + 10});
      triangles.push_back({a, a + 10, a + 9});
    }
  const Mesh mesh = make_mesh(vertices, triangles);
  for (int trial = 0; trial < 3000; ++trial) {
    // Towards a point of an edge, a corner or a face.
    const auto& t = triangles[static_cast<std::size_t>(trial) % triangles.size()];
    const double u = trial % 3 == 0 ? 0 : std::abs(random()) / 2, v = trial % 2 ? 0 : std::abs(random()) / 2;
    const Vec3 target = (1 - u - v) * vertices[t[0]] + u * vertices[t[1]] + v * vertices[t[2]];
    // Not at the rim, where rounding may pass beside the surface.
    if (std::abs(target.x) > 1.99 || std::abs(target.y) > 1.49) continue;
    // Straight down, or steeper than the surface, so that no edge is an outline that rounding may miss.
    const Vec3 aside = trial % 7 == 0 ? Vec3{} : Vec3{0.2 * random(), 0.2 * random(), 0};
    const Vec3 direction = normalised(aside - Vec3{0, 0, 1});
    const Vec3 origin = target - 4.0 * direction;
    const RayHit on_field = cast_ray(field, {origin, direction}),
                 on_mesh = cast_ray(mesh, {origin, direction});
    CHECK(on_field.distance < 4 + 1e-9);
    CHECK_NEAR(on_field.distance, on_mesh.distance, 1e-12);
  }
}
