#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "amontons/collision/pairs/collide.hpp"

// Shapes, poses and measures for the tests of the narrow phase.
namespace scenes {

using namespace amontons;

using Triangle = std::array<std::int32_t, 3>;

// A repeatable stream of numbers in [-1, 1) (xorshift64*), the same everywhere.
struct Random {
  std::uint64_t state = 0x9E3779B97F4A7C15u;
  double operator()() {
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return static_cast<double>((state * 0x2545F4914F6CDD1Du) >> 11) / 4503599627370496.0 - 1;
  }
  Vec3 vector() {
    const double x = (*this)(), y = (*this)(), z = (*this)();
    return {x, y, z};
  }
  Quat rotation() { return exponential(3.0 * vector()); }
};

inline Quat turn(const Vec3& axis, double angle) { return exponential(angle * normalised(axis)); }

inline std::vector<ContactPoint> contacts(const Shape& a, const Transform& frame_a, const Shape& b,
                                          const Transform& frame_b, double margin) {
  std::vector<ContactPoint> points;
  collide(a, frame_a, b, frame_b, margin, points);
  return points;
}
inline double least_gap(const std::vector<ContactPoint>& points) {
  double least = INFINITY;
  for (const ContactPoint& p : points) least = std::min(least, p.gap);
  return least;
}

// A prism of `sides` sides about z: its caps come as fans of triangles, which make_hull() has to merge.
inline Hull prism(int sides, double radius, double half_length) {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
  for (int level = 0; level < 2; ++level)
    for (int k = 0; k < sides; ++k) {
      const double angle = 6.283185307179586 * k / sides;
      vertices.push_back(
          {radius * std::cos(angle), radius * std::sin(angle), level ? half_length : -half_length});
    }
  for (int k = 0; k < sides; ++k) {
    const int next = (k + 1) % sides;
    triangles.push_back({k, next, next + sides});
    triangles.push_back({k, next + sides, k + sides});
    if (k == 0 || next == 0) continue;
    triangles.push_back({0, next, k});
    triangles.push_back({sides, sides + k, sides + next});
  }
  return make_hull(vertices, triangles);
}
inline std::vector<Vec3> box_corners(const Vec3& half) {
  std::vector<Vec3> v;
  for (int k = 0; k < 8; ++k)
    v.push_back({k & 1 ? half.x : -half.x, k & 2 ? half.y : -half.y, k & 4 ? half.z : -half.z});
  return v;
}
// Of such corners.
inline const std::vector<Triangle> box_faces{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                             {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                             {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
inline Hull box_hull(const Vec3& half) { return make_hull(box_corners(half), box_faces); }

// An ellipsoid of rings x sides quadrilaterals and triangles at the poles, each quadrilateral of two
// triangles.
inline Hull pebble(int rings, int sides, const Vec3& radii) {
  std::vector<Vec3> v{{0, 0, -radii.z}};
  for (int r = 1; r < rings; ++r)
    for (int k = 0; k < sides; ++k) {
      const double up = 3.141592653589793 * r / rings, around = 6.283185307179586 * k / sides;
      v.push_back({radii.x * std::sin(up) * std::cos(around), radii.y * std::sin(up) * std::sin(around),
                   -radii.z * std::cos(up)});
    }
  v.push_back({0, 0, radii.z});
  std::vector<Triangle> t;
  const auto at = [&](int ring, int k) { return 1 + (ring - 1) * sides + k % sides; };
  const int top = static_cast<int>(v.size()) - 1;
  for (int k = 0; k < sides; ++k) {
    t.push_back({0, at(1, k + 1), at(1, k)});
    t.push_back({top, at(rings - 1, k), at(rings - 1, k + 1)});
    for (int r = 1; r + 1 < rings; ++r) {
      t.push_back({at(r, k), at(r, k + 1), at(r + 1, k + 1)});
      t.push_back({at(r, k), at(r + 1, k + 1), at(r + 1, k)});
    }
  }
  return make_hull(v, t);
}

using Polygon = std::vector<std::array<double, 2>>;

inline double area(const Polygon& p) {
  double twice = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const auto &a = p[i], &b = p[(i + 1) % p.size()];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return twice / 2;
}

// The convex hull, counter-clockwise (Andrew's monotone chain).
inline Polygon hull_of(Polygon p) {
  std::sort(p.begin(), p.end());
  Polygon h;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t base = h.size();
    for (const auto& q : p) {
      while (h.size() >= base + 2) {
        const auto &a = h[h.size() - 2], &b = h.back();
        if ((b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]) > 0) break;
        h.pop_back();
      }
      h.push_back(q);
    }
    if (!h.empty()) h.pop_back();
    std::reverse(p.begin(), p.end());
  }
  return h;
}

// The common part of two convex polygons, both counter-clockwise.
inline Polygon intersection(Polygon subject, const Polygon& window) {
  for (std::size_t e = 0; e < window.size(); ++e) {
    const auto &a = window[e], &b = window[(e + 1) % window.size()];
    const auto side = [&](const std::array<double, 2>& q) {
      return (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]);
    };
    Polygon out;
    for (std::size_t i = 0; i < subject.size(); ++i) {
      const auto &p = subject[i], &q = subject[(i + 1) % subject.size()];
      const double sp = side(p), sq = side(q);
      if (sp >= 0) out.push_back(p);
      if ((sp < 0) != (sq < 0)) {
        const double t = sp / (sp - sq);
        out.push_back({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])});
      }
    }
    subject = out;
  }
  return subject;
}

}  // namespace scenes
