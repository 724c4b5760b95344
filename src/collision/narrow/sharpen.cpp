#include <cmath>

#include "collision/narrow/gjk.hpp"

// EPA approaches round surfaces by triangles, which leaves a depth good to 1e-8 of the size with a normal
// good to its root only. Where the surface is known better than that, this sharpens the normal.
namespace amontons::collision {

namespace {

double separated_by(const Convex& a, const Convex& b, const Vec3& n) {
  return dot(n, support(a, -n) - support(b, n)) - a.radius - b.radius;
}

// The side of a cylinder is that of the capsule around its axis.
Convex as_capsule(const Convex& body) {
  if (body.kind != Convex::Kind::cylinder) return body;
  Convex capsule = body;
  capsule.kind = Convex::Kind::segment;
  capsule.radius = body.size.x;
  return capsule;
}

void sharpen_sides(const Convex& a, const Convex& b, Separation& s) {
  const auto touches_side = [&](const Convex& body) {
    return body.kind == Convex::Kind::cylinder && std::abs(dot(body.axis[2], s.normal)) < 0.5;
  };
  if (!touches_side(a) && !touches_side(b)) return;
  const Convex p = touches_side(a) ? as_capsule(a) : a, q = touches_side(b) ? as_capsule(b) : b;
  const double size = pair_scale(a, b).size;
  const Separation t = separation(p, q, 0.01 * size);
  // The capsule bulges at its ends: it must see what the cylinder does, and no less than was known.
  if (!t.within || norm_squared(t.normal - s.normal) > 1e-4) return;
  if (t.distance < s.distance - 1e-12 * size ||
      std::abs(separated_by(a, b, t.normal) - t.distance) > 1e-9 * size)
    return;
  s = t;
}

// The best normal n of two smooth bodies is parallel to the difference w of its support points, since that is
// the gradient of the separation <n, w(n)>. Newton's method for the part of w across n, with differences for
// its derivative.
void sharpen_smooth(const Convex& a, const Convex& b, Separation& s) {
  constexpr double step = 1e-5;
  constexpr int most_steps = 4;
  for (int k = 0; k < most_steps; ++k) {
    const Quat frame = rotation_to_z(s.normal);
    const Vec3 u = rotate(frame, {1, 0, 0}), v = rotate(frame, {0, 1, 0});
    // The part across n of w at the normal turned by (x, y).
    const auto across = [&](double x, double y, double& distance, Vec3& on_a, Vec3& on_b, Vec3& n) {
      n = normalised(s.normal + x * u + y * v);
      on_a = support(a, -n) - a.radius * n;
      on_b = support(b, n) + b.radius * n;
      const Vec3 w = on_a - on_b;
      distance = dot(n, w);
      const Vec3 t = w - distance * n;
      return std::array<double, 2>{dot(u, t), dot(v, t)};
    };
    double distance, unused;
    Vec3 on_a, on_b, n, p, q, m;
    const auto g = across(0, 0, distance, on_a, on_b, n);
    const auto gx = across(step, 0, unused, p, q, m), gy = across(0, step, unused, p, q, m);
    const double xx = (gx[0] - g[0]) / step, xy = (gy[0] - g[0]) / step, yx = (gx[1] - g[1]) / step,
                 yy = (gy[1] - g[1]) / step, det = xx * yy - xy * yx;
    if (!(std::abs(det) > 0)) return;
    const double x = -(yy * g[0] - xy * g[1]) / det, y = -(xx * g[1] - yx * g[0]) / det;
    if (!(x * x + y * y < 1e-2)) return;
    const auto next = across(x, y, distance, on_a, on_b, n);
    // A corner instead of a smooth surface jumps: keep what was.
    if (!(next[0] * next[0] + next[1] * next[1] < 0.25 * (g[0] * g[0] + g[1] * g[1]))) return;
    if (distance < s.distance - 1e-9 * pair_scale(a, b).size) return;
    s.normal = n;
    s.distance = distance;
    s.on_a = on_a;
    s.on_b = on_b;
  }
}

}  // namespace

void sharpen(const Convex& a, const Convex& b, Separation& s) {
  if (a.kind == Convex::Kind::ellipsoid || b.kind == Convex::Kind::ellipsoid)
    sharpen_smooth(a, b, s);
  else
    sharpen_sides(a, b, s);
}

}  // namespace amontons::collision
