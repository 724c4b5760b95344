#include "collision/narrow/smooth.hpp"

#include <cmath>

// The best normal n of two smooth bodies is parallel to the difference w(n) of their support points: w is the
// gradient of the separation <n, w(n)>, which is largest over the unit sphere where the gradient has no part
// across n. Newton's method for that part, in two tangent coordinates, with differences for its derivative.
namespace amontons::collision {

namespace {

// The bodies seen along a normal.
struct View {
  Vec3 normal, on_a, on_b;  // the support points, radii included
  double distance;          // <n, w>
  double u, v;              // the part of w = on_a - on_b across n, in fixed tangent directions
};

View look(const Convex& a, const Convex& b, const Vec3& n, const Vec3& u, const Vec3& v) {
  View view;
  view.normal = n;
  view.on_a = support(a, -n) - a.radius * n;
  view.on_b = support(b, n) + b.radius * n;
  const Vec3 w = view.on_a - view.on_b;
  view.distance = dot(n, w);
  const Vec3 across = w - view.distance * n;
  view.u = dot(u, across);
  view.v = dot(v, across);
  return view;
}

}  // namespace

void sharpen_smooth(const Convex& a, const Convex& b, Separation& s) {
  constexpr double step = 1e-5;
  constexpr int most_steps = 4;
  for (int k = 0; k < most_steps; ++k) {
    const Quat frame = rotation_to_z(s.normal);
    const Vec3 u = rotate(frame, {1, 0, 0}), v = rotate(frame, {0, 1, 0});
    // At the normal turned by about (x, y) radians.
    const auto turned = [&](double x, double y) {
      return look(a, b, normalised(s.normal + x * u + y * v), u, v);
    };
    const View g = turned(0, 0), gx = turned(step, 0), gy = turned(0, step);
    const double xx = (gx.u - g.u) / step, xy = (gy.u - g.u) / step;
    const double yx = (gx.v - g.v) / step, yy = (gy.v - g.v) / step;
    const double det = xx * yy - xy * yx;
    if (!(std::abs(det) > 0)) return;
    const double x = -(yy * g.u - xy * g.v) / det, y = -(xx * g.v - yx * g.u) / det;
    if (!(x * x + y * y < 1e-2)) return;
    const View next = turned(x, y);
    // A corner instead of a smooth surface jumps: keep what was.
    if (!(next.u * next.u + next.v * next.v < 0.25 * (g.u * g.u + g.v * g.v))) return;
    if (next.distance < s.distance - 1e-9 * pair_scale(a, b).size) return;
    s.normal = next.normal;
    s.distance = next.distance;
    s.on_a = next.on_a;
    s.on_b = next.on_b;
  }
}

}  // namespace amontons::collision
