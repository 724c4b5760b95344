#include "collision/narrow/gjk.hpp"

#include <algorithm>
#include <cmath>

// The distance of two convex sets by the algorithm of Gilbert, Johnson and Keerthi (1988): the point of their
// difference nearest to the origin, approached by simplices of its extreme points. The nearest point of a
// simplex is found by the regions of Ericson, Real-Time Collision Detection, section 5.1, with the areas as
// triple products, which lose fewer digits.
namespace amontons::collision {

namespace {

Nearest nearest_on_point(const Simplex& s, int i) {
  return {{i, 0, 0}, {1, 0, 0}, 1, s.point[i].w, norm_squared(s.point[i].w)};
}

Nearest nearest_on_segment(const Simplex& s, int i, int j) {
  const Vec3 &p = s.point[i].w, &q = s.point[j].w;
  const Vec3 e = q - p;
  const double along = -dot(p, e), length = norm_squared(e);
  if (along <= 0 || length == 0) return nearest_on_point(s, i);
  if (along >= length) return nearest_on_point(s, j);
  const double t = along / length;
  const Vec3 v = p + t * e;
  return {{i, j, 0}, {1 - t, t, 0}, 2, v, norm_squared(v)};
}

Nearest nearer(const Nearest& a, const Nearest& b) { return b.squared < a.squared ? b : a; }

}  // namespace

Nearest nearest_on_triangle(const Simplex& s, int i, int j, int k) {
  const Vec3 &a = s.point[i].w, &b = s.point[j].w, &c = s.point[k].w;
  const Vec3 ab = b - a, ac = c - a, n = cross(ab, ac);
  const double area = norm_squared(n);
  const double u = dot(n, cross(b, c)), v = dot(n, cross(c, a)), w = dot(n, cross(a, b));
  // A needle has no usable normal; its edges hold its nearest point as well as it can be told.
  const bool needle = area <= 1e-24 * norm_squared(ab) * norm_squared(ac);
  if (!needle && u > 0 && v > 0 && w > 0) {
    const double sum = u + v + w;
    const Vec3 p = (dot(n, a) / area) * n;
    return {{i, j, k}, {u / sum, v / sum, w / sum}, 3, p, norm_squared(p)};
  }
  return nearer(nearer(nearest_on_segment(s, i, j), nearest_on_segment(s, j, k)),
                nearest_on_segment(s, i, k));
}

namespace {

// False: the origin lies inside the tetrahedron.
bool nearest_on_tetrahedron(const Simplex& s, Nearest& result) {
  constexpr int faces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
  bool outside = false;
  for (const auto& f : faces) {
    const Vec3 &a = s.point[f[0]].w, &d = s.point[f[3]].w;
    const Vec3 ab = s.point[f[1]].w - a, ac = s.point[f[2]].w - a, n = cross(ab, ac);
    const double apex = dot(n, d - a), origin = -dot(n, a);
    const bool flat = apex * apex <= 1e-26 * norm_squared(ab) * norm_squared(ac) * norm_squared(d - a);
    if (!flat && (apex > 0) == (origin > 0)) continue;
    const Nearest candidate = nearest_on_triangle(s, f[0], f[1], f[2]);
    result = outside ? nearer(result, candidate) : candidate;
    outside = true;
  }
  return outside;
}

// Reduces the simplex to what holds its nearest point; false if that is the origin, inside a tetrahedron.
bool reduce(Simplex& s, Vec3& v) {
  Nearest nearest;
  if (s.count == 1)
    nearest = nearest_on_point(s, 0);
  else if (s.count == 2)
    nearest = nearest_on_segment(s, 0, 1);
  else if (s.count == 3)
    nearest = nearest_on_triangle(s, 0, 1, 2);
  else if (!nearest_on_tetrahedron(s, nearest))
    return false;
  DifferencePoint kept[3];
  for (int i = 0; i < nearest.count; ++i) kept[i] = s.point[nearest.index[i]];
  for (int i = 0; i < nearest.count; ++i) s.point[i] = kept[i], s.weight[i] = nearest.weight[i];
  s.count = nearest.count;
  v = nearest.point;
  return true;
}

bool holds(const Simplex& s, const Vec3& w) {
  for (int i = 0; i < s.count; ++i)
    if (s.point[i].w == w) return true;
  return false;
}

// v is the difference of nearby points and has lost digits where the bodies are close; the simplex has not.
Vec3 sharpened_normal(const Simplex& s, const Vec3& v) {
  if (s.count == 3) {
    const Vec3 ab = s.point[1].w - s.point[0].w, ac = s.point[2].w - s.point[0].w, n = cross(ab, ac);
    const double area = norm_squared(n);
    if (area > 1e-16 * norm_squared(ab) * norm_squared(ac))
      return (dot(n, v) < 0 ? -1 : 1) / std::sqrt(area) * n;
  } else if (s.count == 2) {
    const Vec3 e = s.point[1].w - s.point[0].w;
    const Vec3 p = v - (dot(v, e) / norm_squared(e)) * e;
    if (norm_squared(p) > 0.25 * norm_squared(v)) return normalised(p);
  }
  return normalised(v);
}

}  // namespace

PairScale pair_scale(const Convex& a, const Convex& b) {
  return {std::min(a.extent, b.extent), a.extent + b.extent + norm(a.centre - b.centre)};
}

Separation separation(const Convex& a, const Convex& b, double limit) {
  constexpr int most_iterations = 128;
  const PairScale scale = pair_scale(a, b);
  const double radii = a.radius + b.radius, core_limit = limit + radii;
  // Below this the direction of v is rounding: the cores touch.
  const double touching = 1e-9 * scale.size + 1e-14 * scale.reach;
  const bool flat = a.kind != Convex::Kind::ellipsoid && b.kind != Convex::Kind::ellipsoid;
  const double gap_tolerance = flat ? 1e-14 : 1e-13;

  Separation result;
  Simplex s;
  Vec3 v = a.centre - b.centre;
  if (norm_squared(v) == 0) v = a.axis[0];
  bool overlap = false;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const DifferencePoint p = difference_support(a, b, -v);
    const double vv = norm_squared(v), vw = dot(v, p.w);
    if (core_limit < 0 ? vw > 0 : (vw > 0 && vw * vw > core_limit * core_limit * vv)) return result;
    if (s.count > 0 && (vv - vw <= gap_tolerance * vv || holds(s, p.w))) break;
    const Simplex before = s;
    s.point[s.count] = p;
    s.weight[s.count++] = 1;
    Vec3 next;
    if (!reduce(s, next)) {
      overlap = true;
      break;
    }
    const double squared = norm_squared(next);
    if (before.count > 0 && squared >= vv) {  // no progress left in this precision
      s = before;
      break;
    }
    v = next;
    if (squared <= touching * touching) {
      overlap = true;
      break;
    }
  }

  if (overlap) {
    penetration(a, b, s, result);
  } else {
    result.normal = sharpened_normal(s, v);
    result.on_a = result.on_b = {};
    for (int i = 0; i < s.count; ++i) {
      result.on_a += s.weight[i] * s.point[i].a;
      result.on_b += s.weight[i] * s.point[i].b;
    }
    result.distance = dot(result.normal, s.point[0].w);
  }
  result.distance -= radii;
  result.on_a -= a.radius * result.normal;
  result.on_b += b.radius * result.normal;
  if (overlap) sharpen(a, b, result);
  result.within = result.distance <= limit;
  return result;
}

}  // namespace amontons::collision
