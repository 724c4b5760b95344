#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <vector>

#include "amontons/collision/collide.hpp"
#include "check.hpp"
#include "collision/convex.hpp"
#include "problems.hpp"

using namespace amontons;

namespace {

constexpr double pi = 3.14159265358979323846;
using Triangle = std::array<std::int32_t, 3>;

struct Triangles {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  Mesh mesh() const { return make_mesh(vertices, triangles); }
};

// A floor of n x n squares of side `cell` about the origin at heights z(x, y), with inner corners moved at random by
// up to `jitter` cells and diagonals drawn at random.
Triangles floor_mesh(int n, double cell, double jitter, unsigned seed, const std::function<double(double, double)>& z) {
  small::Random random(seed);
  Triangles t;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const bool inner = i > 0 && j > 0 && i < n && j < n;
      const double x = cell * (i - 0.5 * n + (inner ? jitter * random.uniform(-1, 1) : 0));
      const double y = cell * (j - 0.5 * n + (inner ? jitter * random.uniform(-1, 1) : 0));
      t.vertices.push_back({x, y, z(x, y)});
    }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = j * (n + 1) + i, b = a + 1, c = b + n + 1, d = a + n + 1;
      if (random.below(2)) {
        t.triangles.push_back({a, b, c}), t.triangles.push_back({c, d, a});
      } else {
        t.triangles.push_back({b, c, d}), t.triangles.push_back({d, a, b});
      }
    }
  return t;
}

std::vector<ContactPoint> contacts(const Shape& shape, const Transform& frame, const Shape& surface, double margin,
                                   const Transform& frame_surface = {}) {
  std::vector<ContactPoint> points;
  collide(shape, frame, surface, frame_surface, margin, points);
  return points;
}

double smallest_gap(const std::vector<ContactPoint>& points) {
  double gap = std::numeric_limits<double>::infinity();
  for (const ContactPoint& p : points) gap = std::min(gap, p.gap);
  return gap;
}

bool has_point(const std::vector<ContactPoint>& points, const Vec3& at, double gap, double tolerance) {
  return std::any_of(points.begin(), points.end(), [&](const ContactPoint& p) {
    return norm(p.point - at) <= tolerance && std::abs(p.gap - gap) <= tolerance;
  });
}

const std::vector<Shape> all_shapes() {
  std::vector<Vec3> corners;
  for (int k = 0; k < 8; ++k) corners.push_back({k & 1 ? 0.4 : -0.4, k & 2 ? 0.3 : -0.3, k & 4 ? 0.2 : -0.2});
  const std::vector<Triangle> faces{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return {Sphere{0.3},          Box{{0.4, 0.3, 0.2}},         Capsule{0.2, 0.3},
          Cylinder{0.25, 0.15}, Ellipsoid{{0.4, 0.3, 0.2}}, make_hull(corners, faces)};
}

// The points on a mesh or field are those on the plane: no other one, the deepest among them, and for a body that
// lies flat (`all`) every one.
void check_as_on_plane(const Shape& shape, const Transform& frame, const Shape& surface, double margin, bool all) {
  const auto expected = contacts(shape, frame, Plane{}, margin), found = contacts(shape, frame, surface, margin);
  CHECK(found.size() == expected.size() || (!all && !found.empty() && found.size() < expected.size()));
  CHECK_NEAR(smallest_gap(found), smallest_gap(expected), 1e-9);
  for (const ContactPoint& p : found) {
    CHECK(has_point(expected, p.point, p.gap, 1e-9));
    CHECK_NEAR(norm(p.normal - Vec3{0, 0, 1}), 0, 1e-9);
  }
}

Quat random_rotation(small::Random& random) {
  return normalised(Quat{random.normal(), random.normal(), random.normal(), random.normal()});
}

double lowest_point(const Shape& shape, const Quat& rotation) { return bounds(shape, {{}, rotation}).lower.z; }

void check_floor(const Shape& surface, unsigned seed) {
  small::Random random(seed);
  for (const Shape& shape : all_shapes())
    for (int pose = 0; pose < 300; ++pose) {
      // Upright and lying (flat faces and lines down), slightly rocked, and in any orientation; gaps of either sign;
      // every fourth pose exactly over a corner or an edge of the cells.
      Quat rotation = exponential({0, 0, random.uniform(0, 2 * pi)});
      if (pose % 4 == 1) rotation = rotation * exponential({pi / 2, 0, 0});
      if (pose % 4 == 2) rotation = rotation * exponential({1e-3 * random.normal(), 1e-3 * random.normal(), 0});
      if (pose % 4 == 3) rotation = random_rotation(random);
      const double gap = std::array{0.004, 1e-6, 0.0, -1e-6, -0.01}[pose % 5];
      Vec3 at{random.uniform(-1, 1), random.uniform(-1, 1), gap - lowest_point(shape, rotation)};
      if (pose % 3 == 0) at.x = 0.25 * std::round(at.x / 0.25);
      if (pose % 6 == 0) at.y = 0.25 * std::round(at.y / 0.25);
      check_as_on_plane(shape, {at, rotation}, surface, 0.01, pose % 4 != 3);
    }
}

}  // namespace

// Sliding across the inner edges of a flat floor feels nothing: normals of single triangles, points lost between
// two triangles, or points made by inner edges would show.
TEST(flat_floor_is_a_plane) {
  check_floor(floor_mesh(16, 0.25, 0, 1, [](double, double) { return 0.0; }).mesh(), 1);
  check_floor(floor_mesh(16, 0.25, 0.3, 2, [](double, double) { return 0.0; }).mesh(), 2);
  check_floor(floor_mesh(50, 0.08, 0.3, 3, [](double, double) { return 0.0; }).mesh(), 3);  // bodies over many
}

TEST(flat_height_field_is_a_plane) {
  check_floor(make_height_field(std::vector<double>(17 * 17, 0.0), 17, 17, 4, 4), 4);
  check_floor(make_height_field(std::vector<double>(9 * 41, 0.0), 9, 41, 4, 4), 5);
}

namespace {

Triangles icosahedron() {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  Triangles t;
  t.vertices = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0}, {0, -1, g}, {0, 1, g},
                {0, -1, -g}, {0, 1, -g}, {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  t.triangles = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8}, {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}};
  for (Vec3& v : t.vertices) v = normalised(v);
  return t;
}

// Every triangle becomes four; `round`: new corners are moved out to the unit sphere.
Triangles refined(const Triangles& t, bool round) {
  Triangles out;
  const auto add = [&](const Vec3& v) {
    out.vertices.push_back(v);  // repeated: make_mesh has to find that they are the same
    return static_cast<std::int32_t>(out.vertices.size() - 1);
  };
  for (const Triangle& f : t.triangles) {
    Vec3 v[3], m[3];
    for (int k = 0; k < 3; ++k) v[k] = t.vertices[f[k]];
    for (int k = 0; k < 3; ++k) {
      m[k] = 0.5 * (v[k] + v[(k + 1) % 3]);
      if (round) m[k] = normalised(m[k]);
    }
    const Vec3 parts[4][3] = {{v[0], m[0], m[2]}, {v[1], m[1], m[0]}, {v[2], m[2], m[1]}, {m[0], m[1], m[2]}};
    for (const auto& part : parts) {
      const std::int32_t a = add(part[0]), b = add(part[1]), c = add(part[2]);
      out.triangles.push_back({a, b, c});
    }
  }
  return out;
}

Triangles box_mesh(const Vec3& half) {
  Triangles t;
  for (int k = 0; k < 8; ++k)
    t.vertices.push_back({k & 1 ? half.x : -half.x, k & 2 ? half.y : -half.y, k & 4 ? half.z : -half.z});
  t.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return t;
}

// How far the body extends beyond the contact point on its surface, along the normal: 0 for a normal of the body.
double beyond(const Triangles& body, const ContactPoint& contact) {
  double most = -std::numeric_limits<double>::infinity();
  const Vec3 on_surface = contact.point - (0.5 * contact.gap) * contact.normal;
  for (const Vec3& v : body.vertices) most = std::max(most, dot(contact.normal, v - on_surface));
  return most;
}

// The mesh of a convex body against that body itself, in random poses at given gaps: the exact distance, or depth, is
// that of the two convex bodies.
void check_as_hull(const Triangles& triangles, const Shape& hull, const std::vector<double>& gaps, unsigned seed) {
  small::Random random(seed);
  const Shape mesh = triangles.mesh();
  const collision::Convex exact = collision::make_convex(hull, {}, {});
  for (const Shape& shape : all_shapes())
    for (int pose = 0; pose < 200; ++pose) {
      Transform frame{{}, random_rotation(random)};
      frame.position = 2.0 * normalised(Vec3{random.normal(), random.normal(), random.normal()});
      const double gap = gaps[pose % gaps.size()];
      collision::Separation s = collision::separation(collision::make_convex(shape, frame, {}), exact, 10);
      frame.position -= (s.distance - gap) * s.normal;
      s = collision::separation(collision::make_convex(shape, frame, {}), exact, 10);
      const auto found = contacts(shape, frame, mesh, std::max(gap, 0.0) + 0.02);
      // Manifolds may take the normal of a face within some degrees instead of the exact one: of gaps of that order
      // the sines and cosines of a few degrees are lost. Where an edge or corner overlaps, several normals may be
      // taken, each with a depth of its own between the least one and what the body has been moved in by.
      const double tolerance = 1e-6 + 0.02 * std::abs(gap);
      static int shown = 0;
      bool bad = smallest_gap(found) > s.distance + tolerance || smallest_gap(found) < gap - tolerance;
      for (auto& p : found) bad |= !(beyond(triangles, p) <= 0.1 * std::abs(p.gap) + 1e-6);
      if (bad && shown++ < 200) {
    std::printf("mesh %u shape %zu pose %d gap %g\n", seed, shape.index(), pose, gap);
    std::printf("  hull n (%.6f %.6f %.6f) at %.6f %.6f %.6f  %g\n", s.normal.x, s.normal.y, s.normal.z, s.on_b.x, s.on_b.y, s.on_b.z, s.distance);
    for (auto& p : found) std::printf("  mesh (%.6f %.6f %.6f) n (%.6f %.6f %.6f) %g beyond %g\n", p.point.x, p.point.y, p.point.z, p.normal.x, p.normal.y, p.normal.z, p.gap, beyond(triangles, p));
      }
      CHECK(smallest_gap(found) <= s.distance + tolerance);
      CHECK(smallest_gap(found) >= gap - tolerance);
      for (const ContactPoint& p : found) CHECK(beyond(triangles, p) <= 0.1 * std::abs(p.gap) + 1e-6);
    }
}

}  // namespace

// Ridges, corners and faces of convex bodies: their mesh must act as the bodies themselves do. A normal outside the
// Voronoi region of an edge, or one snapped that should not be, changes the smallest gap.
TEST(mesh_of_a_convex_body_acts_like_it) {
  const Triangles ball = icosahedron(), box = box_mesh({0.7, 0.5, 0.6});
  const Shape hull = make_hull(ball.vertices, ball.triangles);
  for (const std::vector<double>& gaps : {std::vector<double>{0.02, 1e-3, 1e-6}, {-1e-6, -1e-3, -5e-3}}) {
    check_as_hull(ball, hull, gaps, 1);
    check_as_hull(refined(refined(ball, false), false), hull, gaps, 2);
    check_as_hull(box, Box{{0.7, 0.5, 0.6}}, gaps, 3);
    check_as_hull(refined(refined(box, false), false), Box{{0.7, 0.5, 0.6}}, gaps, 4);
  }
}
