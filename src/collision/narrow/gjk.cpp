#include "collision/narrow/gjk.hpp"

#include <algorithm>
#include <cmath>

// The distance of two convex sets by the algorithm of Gilbert, Johnson and Keerthi (1988). It finds the point
// v of their difference C nearest to the origin, approached by simplices of extreme points of C.
//
// For the extreme point w of C along -v, <v, w> / |v| bounds the distance from below. For all of C is beyond
// the plane through w with the normal v. |v| bounds it from above, as v is in C. Unless the two bounds agree,
// the simplex joined by w contains a point nearer to the origin than v. It is reduced to the corners that
// span that point, so that it never has more than four. For polyhedra this ends after finitely many steps.
//
// The nearest point of a simplex is found by the regions of Ericson, Real-Time Collision Detection,
// section 5.1, with the areas as triple products, which lose fewer digits.
namespace amontons::collision {

namespace {

// Each of these returns the subset of the corners i, j, ... that spans the point nearest to the origin.
Nearest nearest_on_point(const Simplex& s, int i) {
  return {{i, 0, 0}, {1, 0, 0}, 1, s.point[i].w, norm_squared(s.point[i].w)};
}

// Points beyond an end project on that end; a segment of zero length counts as its first end. The foot of the
// origin on the line is at t = -<p, e> / <e, e> along e = q - p.
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

// The nearest point is on a face with the origin on its outer side. There the apex d and the origin on
// different sides of the plane of a, b, c. A flat tetrahedron has no inside; all its faces are candidates.
// False: the origin is inside.
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

// The corners among the first `count` points that span their point nearest to the origin. Returns false if
// that is the origin itself, inside a tetrahedron.
bool nearest_on_simplex(const Simplex& s, int count, Nearest& nearest) {
  switch (count) {
    case 1:
      nearest = nearest_on_point(s, 0);
      return true;
    case 2:
      nearest = nearest_on_segment(s, 0, 1);
      return true;
    case 3:
      nearest = nearest_on_triangle(s, 0, 1, 2);
      return true;
    default:
      return nearest_on_tetrahedron(s, nearest);
  }
}

// Reduces the simplex to the corners that span its nearest point.
void keep(Simplex& s, const Nearest& nearest) {
  DifferencePoint kept[3];
  for (int i = 0; i < nearest.count; ++i) kept[i] = s.point[nearest.index[i]];
  std::copy_n(kept, nearest.count, s.point);
  std::copy_n(nearest.weight, nearest.count, s.weight);
  s.count = nearest.count;
}

// Whether w already is a corner: then C extends no farther along -v, and v is the answer.
bool holds(const Simplex& s, const Vec3& w) {
  return std::any_of(s.point, s.point + s.count, [&](const DifferencePoint& p) { return p.w == w; });
}

// The direction of v, the simplex's point nearest to the origin. v is the difference of nearby points and has
// lost digits if the bodies are close. At a gap of 1e-9 of their size only seven are left, which would tilt
// the plane of a contact. The simplex is as large as the bodies and has lost none. v is perpendicular to its
// face, or to its edge, whose part is removed. For a corner only v itself is known.
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

// The weights of a point of the plane are the areas of its triangles with the edges. If all are positive, the
// foot of the origin is inside; otherwise the nearest point is on an edge.
Nearest nearest_on_triangle(const Simplex& s, int i, int j, int k) {
  const Vec3 &a = s.point[i].w, &b = s.point[j].w, &c = s.point[k].w;
  const Vec3 ab = b - a, ac = c - a, n = cross(ab, ac);
  const double area = norm_squared(n);
  // Twice the areas of the triangles of the origin's projection with the edges, times |n|: <n, b x c> = <n,
  // (b - o) x (c - o)> for any o along n. Their ratios are the weights of the corners.
  const double u = dot(n, cross(b, c)), v = dot(n, cross(c, a)), w = dot(n, cross(a, b));
  // A needle has no usable normal; its edges contain its nearest point to the available accuracy.
  const bool needle = area <= 1e-24 * norm_squared(ab) * norm_squared(ac);
  if (!needle && u > 0 && v > 0 && w > 0) {
    const double sum = u + v + w;
    const Vec3 p = (dot(n, a) / area) * n;
    return {{i, j, k}, {u / sum, v / sum, w / sum}, 3, p, norm_squared(p)};
  }
  return nearer(nearer(nearest_on_segment(s, i, j), nearest_on_segment(s, j, k)),
                nearest_on_segment(s, i, k));
}

Cores distance_of_cores(const Convex& a, const Convex& b, double limit, Simplex& s, Separation& result) {
  // Polyhedra take a handful of steps, round bodies some tens; the limit ends cycles by rounding.
  constexpr int most_iterations = 128;
  const PairScale scale = pair_scale(a, b);
  // Below this the direction of v is rounding: the cores touch. The rounding of w is about 1e-16 of the
  // reach, and 1e-9 of the size is negligible as a contact distance.
  const double touching = 1e-9 * scale.size + 1e-14 * scale.reach;
  const bool flat = a.kind != Convex::Kind::ellipsoid && b.kind != Convex::Kind::ellipsoid;
  // Allowed relative difference of the squared bounds: rounding of dot products, and for ellipsoids of the
  // root in their support function too.
  const double gap_tolerance = flat ? 1e-14 : 1e-13;

  // Any start direction is valid; along the line of centres the first support point is a good one.
  Vec3 v = a.centre - b.centre;
  if (norm_squared(v) == 0) v = a.axis[0];
  // Invariant: v is the point of the simplex s nearest to the origin (except the first v, whose simplex is
  // empty).
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const DifferencePoint p = difference_support(a, b, -v);
    const double vv = norm_squared(v), vw = dot(v, p.w);
    // <v, w> / |v| > limit, without a root: most pairs of the broad phase end here within a few steps.
    if (vw > 0 && (limit < 0 || vw * vw > limit * limit * vv)) return Cores::beyond_limit;
    // The bounds agree, or C extends no farther along -v. (The first v is no point of C and proves nothing.)
    if (s.count > 0 && (vv - vw <= gap_tolerance * vv || holds(s, p.w))) break;
    // The point joins behind the corners; it counts once it is known to be progress.
    s.point[s.count] = p;
    Nearest nearest;
    if (!nearest_on_simplex(s, s.count + 1, nearest)) {
      s.weight[s.count++] = 1;
      return Cores::overlap;
    }
    if (s.count > 0 && nearest.squared >= vv) break;  // no progress left in this precision
    keep(s, nearest);
    v = nearest.point;
    if (nearest.squared <= touching * touching) return Cores::overlap;
  }

  // The corners of the simplex have equal height along the normal. The first one gives the distance with one
  // rounding instead of those of the weighted sum.
  result.normal = sharpened_normal(s, v);
  result.on_a = result.on_b = {};
  for (int i = 0; i < s.count; ++i) {
    result.on_a += s.weight[i] * s.point[i].a;
    result.on_b += s.weight[i] * s.point[i].b;
  }
  result.distance = dot(result.normal, s.point[0].w);
  return Cores::apart;
}

}  // namespace amontons::collision
