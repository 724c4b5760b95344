#include "collision/narrow/gjk.hpp"

#include <cmath>

// The distance of two convex sets by the algorithm of Gilbert, Johnson and Keerthi (1988): the point v of
// their difference C nearest to the origin, approached by simplices of extreme points of C.
//
// For the extreme point w of C along -v, <v, w> / |v| bounds the distance from below, as all of C lies beyond
// the plane through w with the normal v; |v| bounds it from above, as v is in C. The simplex joined by w
// holds a point nearer to the origin than v unless the two bounds agree; it is reduced to the corners that
// hold that point, so that it never has more than four. For polyhedra this ends after finitely many steps.
namespace amontons::collision {

namespace {

bool holds(const Simplex& s, const Vec3& w) {
  for (int i = 0; i < s.count; ++i)
    if (s.point[i].w == w) return true;
  return false;
}

// The direction of v, the simplex's point nearest to the origin. v is the difference of nearby points and has
// lost digits where the bodies are close; the simplex has not.
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

// Whether <v, w> proves a distance beyond the limit, without a root.
bool is_beyond(double vw, double vv, double limit) {
  if (limit < 0) return vw > 0;
  return vw > 0 && vw * vw > limit * limit * vv;
}

}  // namespace

Cores distance_of_cores(const Convex& a, const Convex& b, double limit, Simplex& s, Separation& result) {
  constexpr int most_iterations = 128;
  const PairScale scale = pair_scale(a, b);
  // Below this the direction of v is rounding: the cores touch.
  const double touching = 1e-9 * scale.size + 1e-14 * scale.reach;
  const bool flat = a.kind != Convex::Kind::ellipsoid && b.kind != Convex::Kind::ellipsoid;
  const double gap_tolerance = flat ? 1e-14 : 1e-13;

  Vec3 v = a.centre - b.centre;
  if (norm_squared(v) == 0) v = a.axis[0];
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const DifferencePoint p = difference_support(a, b, -v);
    const double vv = norm_squared(v), vw = dot(v, p.w);
    if (is_beyond(vw, vv, limit)) return Cores::beyond_limit;
    // The bounds agree, or C has nothing new along -v. (The first v is no point of C and proves nothing.)
    if (s.count > 0 && (vv - vw <= gap_tolerance * vv || holds(s, p.w))) break;
    const Simplex before = s;
    s.point[s.count] = p;
    s.weight[s.count++] = 1;
    Vec3 next;
    if (!reduce(s, next)) return Cores::overlap;
    const double squared = norm_squared(next);
    if (before.count > 0 && squared >= vv) {  // no progress left in this precision
      s = before;
      break;
    }
    v = next;
    if (squared <= touching * touching) return Cores::overlap;
  }

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
