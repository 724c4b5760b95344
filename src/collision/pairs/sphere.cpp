#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/pairs/pairs.hpp"

namespace amontons::collision {

namespace {

// `offset` from the nearest point of a core (a point, a segment) with a radius around it.
SurfaceDistance from_core(const Vec3& offset, double radius, const Vec3& fallback) {
  const double d = norm(offset);
  return {d - radius, d > 0 ? offset / d : fallback};
}

SurfaceDistance distance_to_box(const Vec3& half, const Vec3& p) {
  Vec3 offset;
  int shallow = 0;
  bool outside = false;
  for (int i = 0; i < 3; ++i) {
    const double excess = std::abs(p[i]) - half[i];
    if (excess > 0) offset[i] = std::copysign(excess, p[i]), outside = true;
    if (excess > std::abs(p[shallow]) - half[shallow]) shallow = i;
  }
  if (outside) return from_core(offset, 0, {});
  Vec3 normal;
  normal[shallow] = p[shallow] < 0 ? -1 : 1;
  return {std::abs(p[shallow]) - half[shallow], normal};
}

SurfaceDistance distance_to_cylinder(const Cylinder& s, const Vec3& p) {
  const double rho = std::sqrt(p.x * p.x + p.y * p.y), side = p.z < 0 ? -1 : 1;
  const Vec3 radial = rho > 0 ? Vec3{p.x / rho, p.y / rho, 0} : Vec3{1, 0, 0};
  const double out = rho - s.radius, up = std::abs(p.z) - s.half_length;
  if (out > 0 && up > 0) return from_core(out * radial + Vec3{0, 0, side * up}, 0, {});
  return out > up ? SurfaceDistance{out, radial} : SurfaceDistance{up, {0, 0, side}};
}

// The nearest point x of an ellipsoid solves x_i = r_i^2 p_i / (t + r_i^2) with the largest t for which x
// lies on it (Eberly, Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid). In units of
// the smallest axis, with s = t / r_min^2 + 1 > 0, the condition F(s) = sum (e_i y_i / (s + e_i^2 - 1))^2 - 1
// = 0 falls and is convex, so Newton's method from the left never oversteps the root.
SurfaceDistance distance_to_ellipsoid(const Vec3& radii, const Vec3& p) {
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (radii[i] < radii[least]) least = i;
  Vec3 e, y, excess;
  for (int i = 0; i < 3; ++i) {
    e[i] = radii[i] / radii[least], y[i] = std::abs(p[i]) / radii[least];
    excess[i] = (e[i] - 1) * (e[i] + 1);
  }
  // On the symmetry plane of the smallest axis, within the evolute, s vanishes with y: the limit is the
  // answer.
  y[least] = std::max(y[least], 1e-30);
  double s = y[least];
  for (int i = 0; i < 3; ++i) s = std::max(s, e[i] * y[i] - excess[i]);  // one term alone reaches 1 here
  for (int iteration = 0; iteration < 100; ++iteration) {
    double f = -1, slope = 0;
    for (int i = 0; i < 3; ++i) {
      const double q = e[i] * y[i] / (s + excess[i]);
      f += q * q;
      slope -= 2 * q * q / (s + excess[i]);
    }
    const double next = s - f / slope;
    if (!(f > 0) || !(next > s)) break;
    s = next;
  }
  Vec3 x, normal;
  for (int i = 0; i < 3; ++i) {
    x[i] = std::copysign(radii[least] * e[i] * e[i] * y[i] / (s + excess[i]), p[i]);
    normal[i] = x[i] / (e[i] * e[i]);
  }
  normal = normalised(normal);
  return {dot(normal, p - x), normal};
}

}  // namespace

SurfaceDistance distance_to(const Shape& shape, const Vec3& p) {
  if (const auto* sphere = std::get_if<Sphere>(&shape)) return from_core(p, sphere->radius, {0, 0, 1});
  if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    const double z = std::clamp(p.z, -capsule->half_length, capsule->half_length);
    return from_core(p - Vec3{0, 0, z}, capsule->radius, {1, 0, 0});
  }
  if (const auto* box = std::get_if<Box>(&shape)) return distance_to_box(box->half, p);
  if (const auto* cylinder = std::get_if<Cylinder>(&shape)) return distance_to_cylinder(*cylinder, p);
  return distance_to_ellipsoid(std::get<Ellipsoid>(shape).radii, p);
}

void collide_sphere(const Sphere& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
                    double margin, std::vector<ContactPoint>& points) {
  const Vec3 offset = frame_a.position - frame_b.position;
  const SurfaceDistance d = distance_to(b, rotate(conjugate(frame_b.rotation), offset));
  const double gap = d.distance - a.radius;
  if (!(gap <= margin)) return;
  const Vec3 n = rotate(frame_b.rotation, d.normal);
  points.push_back({frame_a.position - (a.radius + 0.5 * gap) * n, n, gap});
}

namespace {

// The parameters in [-1, 1] of the nearest points of the segments +-u and t +- w (Ericson, Real-Time
// Collision Detection, section 5.1.9, for segments given by their middles).
std::pair<double, double> nearest_parameters(const Vec3& u, const Vec3& w, const Vec3& t) {
  const double uu = dot(u, u), ww = dot(w, w), uw = dot(u, w), ut = dot(u, t), wt = dot(w, t);
  const double det = uu * ww - uw * uw;
  double s = det > 1e-20 * uu * ww ? std::clamp((ut * ww - uw * wt) / det, -1.0, 1.0) : 0;
  double r = (s * uw - wt) / ww;
  if (std::abs(r) > 1) {
    r = std::clamp(r, -1.0, 1.0);
    s = std::clamp((ut + r * uw) / uu, -1.0, 1.0);
  }
  return {s, r};
}

}  // namespace

void collide_capsules(const Capsule& a, const Transform& frame_a, const Capsule& b, const Transform& frame_b,
                      double margin, std::vector<ContactPoint>& points) {
  const Vec3 u = rotate(frame_a.rotation, {0, 0, a.half_length}),
             w = rotate(frame_b.rotation, {0, 0, b.half_length}), t = frame_b.position - frame_a.position;
  const double radii = a.radius + b.radius, reach = radii + margin;
  const auto [s, r] = nearest_parameters(u, w, t);
  const Vec3 offset = s * u - t - r * w;
  const double distance = norm(offset);
  if (distance > reach) return;
  const Vec3 crossed = cross(u, w);
  const double lengths = a.half_length * b.half_length, sine = norm(crossed) / lengths;
  Vec3 normal;
  if (distance > 1e-12 * radii) {
    normal = offset / distance;
  } else {  // the axes cross: the way out is perpendicular to both
    normal = sine > 1e-6 ? normalised(crossed) : rotate(frame_a.rotation, {1, 0, 0});
    if (dot(normal, t) > 0) normal = -normal;
  }
  const auto add = [&](const Vec3& on_axis_a, double gap) {
    if (gap <= margin)
      points.push_back({frame_a.position + on_axis_a - (a.radius + 0.5 * gap) * normal, normal, gap});
  };
  // Side by side they touch along a line: at both its ends, each with its own gap, and at the nearest point
  // too where the axes are so far from parallel that this lies clearly deeper.
  constexpr double parallel = 0.1;
  if (sine < parallel && distance > 0.5 * radii) {
    const Vec3 along = u / a.half_length;
    const double middle = dot(along, t), half = std::abs(dot(along, w));
    const double begin = std::max(-a.half_length, middle - half),
                 end = std::min(a.half_length, middle + half);
    if (end - begin > 1e-3 * std::min(a.half_length, b.half_length)) {
      double least = 2 * reach;
      for (double z : {begin, end}) {
        const Vec3 p = z * along;
        const double q = std::clamp(dot(w, p - t) / dot(w, w), -1.0, 1.0);
        const double gap = norm(p - t - q * w) - radii;
        least = std::min(least, gap);
        add(p, gap);
      }
      if (least - (distance - radii) <= 1e-3 * radii) return;
    }
  }
  add(s * u, distance - radii);
}

}  // namespace amontons::collision
