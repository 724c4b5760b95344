#include "collision/narrow/point_distance.hpp"

#include <algorithm>
#include <cmath>

namespace amontons::collision {

namespace {

// `offset` from the nearest point of a core (a point, a segment) with a radius around it.
SurfaceDistance from_core(const Vec3& offset, double radius, const Vec3& fallback) {
  const double d = norm(offset);
  return {d - radius, d > 0 ? offset / d : fallback};
}

// Outside the distance of the nearest point, inside that of the nearest face.
SurfaceDistance distance_to_box(const Vec3& half, const Vec3& p) {
  Vec3 offset;
  int shallow = 0;
  bool outside = false;
  for (int i = 0; i < 3; ++i) {
    const double excess = std::abs(p[i]) - half[i];
    if (excess > 0) {
      offset[i] = std::copysign(excess, p[i]);
      outside = true;
    }
    if (excess > std::abs(p[shallow]) - half[shallow]) shallow = i;
  }
  if (outside) return from_core(offset, 0, {});
  Vec3 normal;
  normal[shallow] = p[shallow] < 0 ? -1 : 1;
  return {std::abs(p[shallow]) - half[shallow], normal};
}

// In the half plane through the axis and p the cylinder is a rectangle; `out` and `up` are the distances from
// its side and its cap.
SurfaceDistance distance_to_cylinder(const Cylinder& s, const Vec3& p) {
  const double rho = std::sqrt(p.x * p.x + p.y * p.y), side = p.z < 0 ? -1 : 1;
  const Vec3 radial = rho > 0 ? Vec3{p.x / rho, p.y / rho, 0} : Vec3{1, 0, 0};
  const double out = rho - s.radius, up = std::abs(p.z) - s.half_length;
  if (out > 0 && up > 0) return from_core(out * radial + Vec3{0, 0, side * up}, 0, {});
  return out > up ? SurfaceDistance{out, radial} : SurfaceDistance{up, {0, 0, side}};
}

// The largest root s of F(s) = sum (e_i y_i / (s + excess_i))^2 - 1 where F falls and is convex: Newton's
// method from the left never oversteps it.
double ellipsoid_root(const Vec3& e, const Vec3& y, const Vec3& excess, double s) {
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
  return s;
}

// The nearest point x of an ellipsoid solves x_i = r_i^2 p_i / (t + r_i^2) with the largest t for which x
// lies on it (Eberly, Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid). In units of
// the smallest axis, with e = r / r_min, y = |p| / r_min and s = t / r_min^2 + 1 > 0, that condition is
// F(s) = sum (e_i y_i / (s + e_i^2 - 1))^2 - 1 = 0.
SurfaceDistance distance_to_ellipsoid(const Vec3& radii, const Vec3& p) {
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (radii[i] < radii[least]) least = i;
  Vec3 e, y, excess;
  for (int i = 0; i < 3; ++i) {
    e[i] = radii[i] / radii[least];
    y[i] = std::abs(p[i]) / radii[least];
    excess[i] = (e[i] - 1) * (e[i] + 1);  // e^2 - 1 without cancellation
  }
  // On the symmetry plane of the smallest axis, within the evolute, s vanishes with y:
  // the limit is the answer.
  y[least] = std::max(y[least], 1e-30);
  double s = y[least];
  for (int i = 0; i < 3; ++i) s = std::max(s, e[i] * y[i] - excess[i]);  // one term alone reaches 1 here
  s = ellipsoid_root(e, y, excess, s);
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

}  // namespace amontons::collision
