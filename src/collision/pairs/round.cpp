#include "collision/pairs/round.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "amontons/collision/pairs/spheres.hpp"

// Closed forms: the distance of a point from a shape, which gives that of a sphere, and the distance of two
// segments, which gives that of two capsules. They are exact where the general algorithm approximates round
// surfaces by planes, and they give the direction out of any depth.
namespace amontons::collision {

namespace {

// The nearest surface point to a given point: at `distance` (negative inside) against `normal`.
struct SurfaceDistance {
  double distance;
  Vec3 normal;  // unit, outwards
};

// From the `offset` to the nearest point of a core (a point, a segment) with a radius around it.
SurfaceDistance from_core(const Vec3& offset, double radius, const Vec3& fallback) {
  const double d = norm(offset);
  return {d - radius, d > 0 ? offset / d : fallback};
}

// Outside: the distance of the nearest point, whose coordinates are those of p clipped to the half edges.
// Inside: that of the nearest face.
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

// By symmetry a two-dimensional problem: in the half plane through the axis and p the cylinder is a
// rectangle. `out` and `up` are the distances from its side and its cap.
SurfaceDistance distance_to_cylinder(const Cylinder& s, const Vec3& p) {
  const double rho = std::sqrt(p.x * p.x + p.y * p.y), side = p.z < 0 ? -1 : 1;
  const Vec3 radial = rho > 0 ? Vec3{p.x / rho, p.y / rho, 0} : Vec3{1, 0, 0};
  const double out = rho - s.radius, up = std::abs(p.z) - s.half_length;
  if (out > 0 && up > 0) return from_core(out * radial + Vec3{0, 0, side * up}, 0, {});
  return out > up ? SurfaceDistance{out, radial} : SurfaceDistance{up, {0, 0, side}};
}

// The largest root s of F(s) = sum (e_i y_i / (s + excess_i))^2 - 1, where F falls and is convex. Newton's
// method from the left, where F > 0, never oversteps it, so it may run until nothing changes. At the start no
// term exceeds 1, so that F <= 2: the root is near, and a handful of steps reach it.
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
  // e, y and the excesses are nonnegative, so F falls for all s > 0 and has one root there. On the symmetry
  // plane of the smallest axis, within the evolute, s vanishes with y: the limit is the answer.
  y[least] = std::max(y[least], 1e-30);
  double s = y[least];
  for (int i = 0; i < 3; ++i) s = std::max(s, e[i] * y[i] - excess[i]);  // one term alone is 1 here
  s = ellipsoid_root(e, y, excess, s);
  Vec3 x, normal;
  for (int i = 0; i < 3; ++i) {
    x[i] = std::copysign(radii[least] * e[i] * e[i] * y[i] / (s + excess[i]), p[i]);
    normal[i] = x[i] / (e[i] * e[i]);
  }
  normal = normalised(normal);
  return {dot(normal, p - x), normal};
}

// The distance of a point in the shape's own frame. On the axis of a round shape all normals are equivalent;
// the chosen one is fixed in the shape.
SurfaceDistance distance_to(const Shape& shape, const Vec3& p) {
  if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    const double z = std::clamp(p.z, -capsule->half_length, capsule->half_length);
    return from_core(p - Vec3{0, 0, z}, capsule->radius, {1, 0, 0});
  }
  if (const auto* box = std::get_if<Box>(&shape)) return distance_to_box(box->half, p);
  if (const auto* cylinder = std::get_if<Cylinder>(&shape)) return distance_to_cylinder(*cylinder, p);
  return distance_to_ellipsoid(std::get<Ellipsoid>(shape).radii, p);
}

// The parameters in [-1, 1] of the nearest points of the segments +-u and t +- w (Ericson, Real-Time
// Collision Detection, section 5.1.9, for segments given by their middles).
std::pair<double, double> nearest_parameters(const Vec3& u, const Vec3& w, const Vec3& t) {
  // s u - t - r w|^2 is least where both derivatives vanish:  s uu - r uw = ut,  s uw - r ww = wt. Parallel
  // segments (det = 0) leave s free; if one parameter is clipped at an end the other one is computed again.
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

// If the axes cross, the direction out is perpendicular to both, to the side on which a's middle is. Axes on
// one line have no such direction: any perpendicular one serves.
Vec3 normal_of_crossing_axes(const Vec3& u, const Vec3& w, const Vec3& t, double sine, const Quat& rotation) {
  const Vec3 normal = sine > 1e-6 ? normalised(cross(u, w)) : rotate(rotation, {1, 0, 0});
  return dot(normal, t) > 0 ? -normal : normal;
}

}  // namespace

// Only the places of the centres count, so that a turn of a ball changes no bit.
void collide_spheres(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const double radius_a = std::get<Sphere>(a.shape).radius, radius_b = std::get<Sphere>(b.shape).radius;
  const ContactPoint p =
      touch_spheres(a.frame.position, radius_a, b.frame.position, radius_b, b.frame.rotation);
  if (p.gap <= margin) points.push_back(p);
}

// The gap is the distance of the sphere's centre from the surface minus the radius, along that surface's
// normal.
void collide_sphere(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const double radius = std::get<Sphere>(a.shape).radius;
  const Vec3 offset = a.frame.position - b.frame.position;
  const SurfaceDistance d = distance_to(b.shape, rotate(conjugate(b.frame.rotation), offset));
  const double gap = d.distance - radius;
  if (!(gap <= margin)) return;
  const Vec3 n = rotate(b.frame.rotation, d.normal);
  points.push_back({a.frame.position - (radius + 0.5 * gap) * n, n, gap});
}

// The gap of two capsules is the distance of their axes minus both radii: exact in every position in which
// the axes do not cross. For crossing axes the direction out is along their common perpendicular.
void collide_capsules(const Posed& posed_a, const Posed& posed_b, double margin,
                      std::vector<ContactPoint>& points) {
  const Capsule &a = std::get<Capsule>(posed_a.shape), &b = std::get<Capsule>(posed_b.shape);
  const Transform &frame_a = posed_a.frame, &frame_b = posed_b.frame;
  // With the middle of a as origin, in world axes: both half axes and the middle of b.
  const Vec3 u = rotate(frame_a.rotation, {0, 0, a.half_length});
  const Vec3 w = rotate(frame_b.rotation, {0, 0, b.half_length}), t = frame_b.position - frame_a.position;
  const double radii = a.radius + b.radius, reach = radii + margin;
  const auto [s, r] = nearest_parameters(u, w, t);
  const Vec3 offset = s * u - t - r * w;
  const double distance = norm(offset);
  if (distance > reach) return;
  const double sine = norm(cross(u, w)) / (a.half_length * b.half_length);  // of the angle between the axes
  const Vec3 normal =
      distance > 1e-12 * radii ? offset / distance : normal_of_crossing_axes(u, w, t, sine, frame_a.rotation);
  const auto add = [&](const Vec3& on_axis_a, double gap) {
    if (gap <= margin)
      points.push_back({frame_a.position + on_axis_a - (a.radius + 0.5 * gap) * normal, normal, gap});
  };
  // Nearly parallel capsules touch along a line: at both its ends, each with its own gap. The nearest point
  // is added if the axes are so far from parallel that it is clearly deeper.
  constexpr double parallel = 0.1;  // rad
  if (distance > 0.5 * radii && sine < parallel) {
    const Vec3 along = u / a.half_length;
    // The interval of a's axis, in units of length along it, beside which b lies.
    const double middle = dot(along, t), half = std::abs(dot(along, w));
    const double begin = std::max(-a.half_length, middle - half),
                 end = std::min(a.half_length, middle + half);
    if (end - begin > 1e-3 * std::min(a.half_length, b.half_length)) {
      double least = 2 * reach;
      for (double z : {begin, end}) {
        const Vec3 on_a = z * along;
        const double q = std::clamp(dot(w, on_a - t) / dot(w, w), -1.0, 1.0);
        const double gap = norm(on_a - t - q * w) - radii;
        least = std::min(least, gap);
        add(on_a, gap);
      }
      if (least - (distance - radii) <= 1e-3 * radii) return;
    }
  }
  add(s * u, distance - radii);
}

}  // namespace amontons::collision
