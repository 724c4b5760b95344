// Floors and bodies of triangles, poses and measures for the tests of meshes and height fields.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "collision_scenes.hpp"
#include "problems.hpp"

namespace meshes {

using namespace amontons;

constexpr double pi = 3.14159265358979323846;
using scenes::least_gap, scenes::Triangle;

struct Triangles {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  Mesh mesh() const { return make_mesh(vertices, triangles); }
};

// A floor of n x n squares of side `cell` about the origin at heights z(x, y), with inner corners moved at
// random by up to `jitter` cells and diagonals drawn at random.
inline Triangles floor_mesh(int n, double cell, double jitter, unsigned seed,
                            const std::function<double(double, double)>& z) {
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
        t.triangles.push_back({a, b, c});
        t.triangles.push_back({c, d, a});
      } else {
        t.triangles.push_back({b, c, d});
        t.triangles.push_back({d, a, b});
      }
    }
  return t;
}

inline std::vector<ContactPoint> contacts(const Shape& shape, const Transform& frame, const Shape& surface,
                                          double margin, const Transform& frame_surface = {}) {
  return scenes::contacts(shape, frame, surface, frame_surface, margin);
}

inline bool has_point(const std::vector<ContactPoint>& points, const Vec3& at, double gap, double tolerance) {
  return std::any_of(points.begin(), points.end(), [&](const ContactPoint& p) {
    return norm(p.point - at) <= tolerance && std::abs(p.gap - gap) <= tolerance;
  });
}

inline std::vector<Shape> all_shapes() {
  const Vec3 half{0.4, 0.3, 0.2};
  return {Sphere{0.3},          Box{half},       Capsule{0.2, 0.3},
          Cylinder{0.25, 0.15}, Ellipsoid{half}, scenes::box_hull(half)};
}

inline Quat random_rotation(small::Random& random) {
  return normalised(Quat{random.normal(), random.normal(), random.normal(), random.normal()});
}

inline double lowest_point(const Shape& shape, const Quat& rotation) {
  return bounds(shape, {{}, rotation}).lower.z;
}

// Every triangle becomes four; `round`: new corners are moved out to the unit sphere.
inline Triangles refined(const Triangles& t, bool round) {
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

inline Triangles box_mesh(const Vec3& half) { return {scenes::box_corners(half), scenes::box_faces}; }

}  // namespace meshes
