#include "collision/narrow/separation.hpp"

#include <cmath>

#include "collision/narrow/epa.hpp"
#include "collision/narrow/gjk.hpp"

// Cores that are apart need only GJK, for any radii: the depth of two capsules is exact while their axes are
// apart. Cores that overlap need EPA, which approximates round surfaces by triangles. Its depth is accurate
// to 1e-8 of the size, its normal only to the root of that. If the surface is known better, the normal is
// refined.
namespace amontons::collision {

namespace {

// The bodies along a normal n: their support points there, radii included, w = on_a - on_b from b to a, and
// the distance <n, w>.
struct View {
  Separation at;
  double u, v;  // the part of w across n, in fixed tangent directions
};

// `u`, `v`: unit, across the normal about which n varies. They are constant while n changes, so that views
// are comparable.
View view_along(const Convex& a, const Convex& b, const Vec3& n, const Vec3& u, const Vec3& v) {
  const Vec3 on_a = support(a, -n) - a.radius * n, on_b = support(b, n) + b.radius * n, w = on_a - on_b;
  const double distance = dot(n, w);
  const Vec3 across = w - distance * n;
  return {{true, distance, n, on_a, on_b}, dot(u, across), dot(v, across)};
}

// EPA's polytope has corners on the surface of C and its faces below it. If C is curved the depth is wrong by
// the height of a cap, the normal by its angle, the root of that height. The best normal n of two smooth
// bodies is parallel to the difference w(n) of their support points. For w is the gradient of the separation
// <n, w(n)>. The separation is largest over the unit sphere where the gradient has no part across n. Newton's
// method finds the zero of that part, in two tangent coordinates, with finite differences for its derivative.
void sharpen_smooth(const Convex& a, const Convex& b, Separation& s) {
  // Radians: about the root of the rounding of w, where truncation and rounding of the difference balance.
  // From the root of EPA's tolerance between smooth bodies, 3e-3, two quadratic steps reach rounding; four
  // suffice.
  constexpr double step = 1e-5;
  constexpr int most_steps = 4;
  for (int k = 0; k < most_steps; ++k) {
    const Quat frame = rotation_to_z(s.normal);
    const Vec3 u = rotate(frame, {1, 0, 0}), v = rotate(frame, {0, 1, 0});
    // At the normal turned by about (x, y) radians.
    const auto turned = [&](double x, double y) {
      return view_along(a, b, normalised(s.normal + x * u + y * v), u, v);
    };
    const View g = turned(0, 0), gx = turned(step, 0), gy = turned(0, step);
    const double xx = (gx.u - g.u) / step, xy = (gy.u - g.u) / step;
    const double yx = (gx.v - g.v) / step, yy = (gy.v - g.v) / step;
    const double det = xx * yy - xy * yx;
    if (!(std::abs(det) > 0)) return;
    const double x = -(yy * g.u - xy * g.v) / det, y = -(xx * g.v - yx * g.u) / det;
    // Beyond 0.1 rad the linear model is invalid.
    if (!(x * x + y * y < 1e-2)) return;
    const View next = turned(x, y);
    // At a corner instead of a smooth surface the value jumps: keep the old normal.
    if (!(next.u * next.u + next.v * next.v < 0.25 * (g.u * g.u + g.v * g.v))) return;
    // A longer way out than the known one is another local maximum.
    if (next.at.distance < s.distance - 1e-9 * pair_scale(a, b).size) return;
    s = next.at;
  }
}

// Among shapes whose cores can overlap only ellipsoids are curved everywhere in both directions.
bool is_smooth(const Convex& body) { return body.kind == Convex::Kind::ellipsoid; }

// The separation of the bodies along a unit normal: a lower bound of their distance, and equal to it for the
// best normal.
double separated_by(const Convex& a, const Convex& b, const Vec3& n) {
  return dot(n, support(a, -n) - support(b, n)) - a.radius - b.radius;
}

// The side of a cylinder is that of the capsule around its axis. The cylinder has an edge where its side
// ends, the capsule has not.
Convex as_capsule(const Convex& body) {
  Convex capsule = body;
  capsule.kind = Convex::Kind::segment;
  capsule.radius = body.size.x;
  return capsule;
}

// If the sides of cylinders touch (the normal is within 30 degrees of the perpendicular to the axis),
// capsules replace the cylinders. Their cores stay apart, and GJK is exact for them.
void sharpen_sides(const Convex& a, const Convex& b, Separation& s) {
  const auto touches_side = [&](const Convex& body) {
    return body.kind == Convex::Kind::cylinder && std::abs(dot(body.axis[2], s.normal)) < 0.5;
  };
  if (!touches_side(a) && !touches_side(b)) return;
  const Convex p = touches_side(a) ? as_capsule(a) : a, q = touches_side(b) ? as_capsule(b) : b;
  const double size = pair_scale(a, b).size;
  const Separation t = separation(p, q, 0.01 * size);
  // The capsule bulges at its ends: accept its result only if it agrees with the cylinder's and is no
  // smaller.
  if (!t.within || norm_squared(t.normal - s.normal) > 1e-4) return;
  if (t.distance < s.distance - 1e-12 * size ||
      std::abs(separated_by(a, b, t.normal) - t.distance) > 1e-9 * size)
    return;
  s = t;
}

// Cylinders apart from the other body are tried as capsules first: GJK is exact for them within a few steps,
// and needs tens for a rim. A cylinder is in its capsule, so that the distance of the capsules is a lower
// bound. It is the distance if the nearest points are on the sides of the cylinders: then the normal is
// perpendicular to the axis. The bodies are as far apart along that normal. False: unknown.
bool separate_sides(const Convex& a, const Convex& b, double limit, Separation& result) {
  const bool is_side_a = a.kind == Convex::Kind::cylinder, is_side_b = b.kind == Convex::Kind::cylinder;
  if ((!is_side_a && !is_side_b) || limit < 0) return false;
  const Convex p = is_side_a ? as_capsule(a) : a, q = is_side_b ? as_capsule(b) : b;
  const double radii = p.radius + q.radius;
  Simplex simplex;
  const Cores cores = distance_of_cores(p, q, limit + radii, simplex, result);
  if (cores == Cores::beyond_limit) return true;
  if (cores == Cores::overlap || !(result.distance > radii)) return false;
  result.distance -= radii;
  if (separated_by(a, b, result.normal) > result.distance + 1e-9 * pair_scale(a, b).size) return false;
  result.on_a -= p.radius * result.normal;
  result.on_b += q.radius * result.normal;
  result.within = result.distance <= limit;
  return true;
}

}  // namespace

// The distance of the bodies is that of the cores minus the radii, along the same normal. So the search may
// stop when the distance of the cores exceeds the limit plus the radii.
Separation separation(const Convex& a, const Convex& b, double limit) {
  Separation result;
  if (separate_sides(a, b, limit, result)) return result;
  Simplex simplex;
  const double radii = a.radius + b.radius;
  const Cores cores = distance_of_cores(a, b, limit + radii, simplex, result);
  if (cores == Cores::beyond_limit) return result;
  if (cores == Cores::overlap) penetration(a, b, simplex, result);
  result.distance -= radii;
  result.on_a -= a.radius * result.normal;
  result.on_b += b.radius * result.normal;
  if (cores == Cores::overlap) {
    if (is_smooth(a) || is_smooth(b))
      sharpen_smooth(a, b, result);
    else
      sharpen_sides(a, b, result);
  }
  result.within = result.distance <= limit;
  return result;
}

}  // namespace amontons::collision
