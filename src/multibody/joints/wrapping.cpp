// Both obstacles are circles in a plane: for a sphere the plane through its centre and both ends, for a
// cylinder the plane normal to its axis. Along a cylinder's axis the string is a helix, straight on the
// unrolled surface, so its height grows in proportion to its path in the plane.
//
// The side is chosen as in MuJoCo: the shorter path or the one on the side of the side point. With a side
// point inside the obstacle the path goes through it.
#include "multibody/joints/wrapping.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "amontons/base/elementary.hpp"
#include "amontons/base/policy.hpp"

namespace amontons {
namespace {

// Angles (rad), lengths (m) and sines below it are rounding of zero.
constexpr double tiny = 1e-15;  // not tuned: rounding

// In the plane of the circle, about its centre.
struct Vec2 {
  double x, y;
};
Vec2 operator+(const Vec2& a, const Vec2& b) { return {a.x + b.x, a.y + b.y}; }
Vec2 operator-(const Vec2& a, const Vec2& b) { return {a.x - b.x, a.y - b.y}; }
Vec2 operator*(double s, const Vec2& a) { return {s * a.x, s * a.y}; }
double dot(const Vec2& a, const Vec2& b) { return a.x * b.x + a.y * b.y; }
double cross(const Vec2& a, const Vec2& b) { return a.x * b.y - a.y * b.x; }
Vec2 left_of(const Vec2& a) { return {-a.y, a.x}; }
double norm(const Vec2& a) { return elementary::hypot(a.x, a.y); }

struct Arc {
  Vec2 first, last;
  double length;
};

// Where the tangent from p touches the circle, turned from p by acos(r / |p|) to the left (turn 1) or right.
Vec2 touching(const Vec2& p, double r, double turn) {
  const double square = dot(p, p);
  return r / square * (r * p + turn * std::sqrt(std::max(0.0, square - r * r)) * left_of(p));
}

// Around the circle, on the shorter path or the other one. The side point decides: the string passes the
// centre on the same side as the path from a over the side point to b. That is the far side if the centre is
// within the triangle of the three points, that is if the side point lies in the cone of -a and -b. On the
// shorter path a string that misses the circle is straight. To the left (turn 1, counter-clockwise) the
// string leaves a for the tangent point on the left of a and reaches b from the one on the right of b.
std::optional<Arc> around(const Vec2& a, const Vec2& b, double r, const std::optional<Vec2>& side) {
  const double turn_short = cross(a, b) >= 0 ? 1 : -1;
  const bool far = side && turn_short * cross(a, *side) < 0 && turn_short * cross(*side, b) < 0;
  const Vec2 way = b - a;
  const Vec2 nearest = a + std::clamp(-dot(way, a) / dot(way, way), 0.0, 1.0) * way;
  if (!far && dot(nearest, nearest) > r * r) return std::nullopt;
  const double turn = far ? -turn_short : turn_short;
  const Vec2 first = touching(a, r, turn), last = touching(b, r, -turn);
  double angle = turn * elementary::atan2(cross(first, last), dot(first, last));
  if (angle < 0) angle += 2 * std::numbers::pi;
  return Arc{first, last, r * angle};
}

// Through the circle. If the straight string misses the circle, it is bent so that it just touches it, at the
// point P for which |a P| + |P b| is least. There it makes the same angle t with the normal on both sides
// (reflection). The triangle of centre, P and a has the angle asin(A sin t) at a, A = r / |a|, hence t -
// asin(A sin t) at the centre. Both such angles add to that between a and b:
//   2 t - asin(A sin t) - asin(B sin t) = G.
// The left side grows with t from 0; its value at t = pi/2 is below G if the straight string meets the
// circle.
std::optional<Arc> through(const Vec2& a, const Vec2& b, double r) {
  const double A = r / norm(a), B = r / norm(b);
  const double G = elementary::atan2(std::abs(cross(a, b)), dot(a, b));
  const auto excess = [&](double t) {
    return 2 * t - elementary::asin(A * elementary::sin(t)) - elementary::asin(B * elementary::sin(t)) - G;
  };
  double low = 0, high = 0.5 * std::numbers::pi;
  if (excess(high) <= 0) return std::nullopt;
  double t = 0.5 * G / (1 - 0.5 * (A + B));
  // Newton's method within brackets: bisection if a step leaves them.
  for (int k = 0; k < 100; ++k) {  // not tuned: more than bisection takes
    if (!(t > low && t < high)) t = 0.5 * (low + high);
    const double f = excess(t), s = elementary::sin(t), c = elementary::cos(t);
    if (f == 0 || high - low < tiny) break;
    (f > 0 ? high : low) = t;
    const double slope = 2 - A * c / std::sqrt(1 - A * A * s * s) - B * c / std::sqrt(1 - B * B * s * s);
    const double next = t - f / slope;
    if (std::abs(next - t) < tiny) break;
    t = next;
  }
  const double turn = (cross(a, b) >= 0 ? 1 : -1) * (t - elementary::asin(A * elementary::sin(t)));
  const Vec2 u = 1 / norm(a) * a;
  const Vec2 P = r * (elementary::cos(turn) * u + elementary::sin(turn) * left_of(u));
  return Arc{P, P, 0};
}

// Two axes of the plane, in the frame of the obstacle. If the ends and the centre of a sphere are collinear
// any plane through them serves.
std::array<Vec3, 2> plane_of(PathElement::Kind kind, const Vec3& a, const Vec3& b) {
  if (kind == PathElement::Kind::cylinder) return {Vec3{1, 0, 0}, Vec3{0, 1, 0}};
  const Vec3 x = normalised(a);
  Vec3 normal = cross(a, b);
  if (norm(normal) < tiny * norm(a) * norm(b)) {
    const Vec3 m{std::abs(x.x), std::abs(x.y), std::abs(x.z)};
    normal = cross(x, m.x <= m.y && m.x <= m.z ? Vec3{1, 0, 0} : m.y <= m.z ? Vec3{0, 1, 0} : Vec3{0, 0, 1});
  }
  return {x, normalised(cross(normal, x))};
}

}  // namespace

std::optional<Wrap> wrap(const Vec3& a_world, const Vec3& b_world, PathElement::Kind kind,
                         const Transform& obstacle, double r, const std::optional<Vec3>& side_world) {
  const Transform into = inverse(obstacle);
  const Vec3 a3 = into(a_world), b3 = into(b_world);
  if (norm(a3) < tiny || norm(b3) < tiny) return std::nullopt;
  // By name, so that the lambda below can capture them: Clang before 16 lacks that for structured bindings.
  const std::array<Vec3, 2> plane = plane_of(kind, a3, b3);
  const Vec3 &x = plane[0], &y = plane[1];
  const auto flat = [&](const Vec3& p) { return Vec2{dot(p, x), dot(p, y)}; };
  const Vec2 a = flat(a3), b = flat(b3);
  // A string that ends within the circle, or has no extent across a cylinder's axis, is straight.
  if (dot(a, a) < r * r || dot(b, b) < r * r || norm(b - a) < tiny) return std::nullopt;
  std::optional<Vec2> side;
  bool inside = false;
  if (side_world) {
    const Vec3 s3 = into(*side_world);
    side = flat(s3);
    inside = norm(s3) < r;
    if (norm(*side) < base::policy.rounding * r) side.reset();  // on the axis it has no side
  }
  const std::optional<Arc> arc = inside ? through(a, b, r) : around(a, b, r, side);
  if (!arc) return std::nullopt;
  Vec3 first = arc->first.x * x + arc->first.y * y, last = arc->last.x * x + arc->last.y * y;
  double length = arc->length;
  if (kind == PathElement::Kind::cylinder) {
    const double before = norm(arc->first - a), after = norm(b - arc->last);
    const double slope = (b3.z - a3.z) / (before + length + after);
    first.z = a3.z + slope * before;
    last.z = a3.z + slope * (before + length);
    length = elementary::hypot(length, last.z - first.z);
  }
  return Wrap{obstacle(first), obstacle(last), length};
}

}  // namespace amontons
