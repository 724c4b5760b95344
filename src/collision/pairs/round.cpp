#include "collision/pairs/round.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/narrow/point_distance.hpp"

namespace amontons::collision {

// The gap is the distance of the sphere's centre from the surface less the radius,
// along that surface's normal.
void collide_sphere(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const double radius = std::get<Sphere>(a.shape).radius;
  const Vec3 offset = a.frame.position - b.frame.position;
  const SurfaceDistance d = distance_to(b.shape, rotate(conjugate(b.frame.rotation), offset));
  const double gap = d.distance - radius;
  if (!(gap <= margin)) return;
  const Vec3 n = rotate(b.frame.rotation, d.normal);
  points.push_back({a.frame.position - (radius + 0.5 * gap) * n, n, gap});
}

namespace {

// The parameters in [-1, 1] of the nearest points of the segments +-u and t +- w (Ericson, Real-Time
// Collision Detection, section 5.1.9, for segments given by their middles).
std::pair<double, double> nearest_parameters(const Vec3& u, const Vec3& w, const Vec3& t) {
  // |s u - t - r w|^2 is least where both derivatives vanish:  s uu - r uw = ut,  s uw - r ww = wt. Parallel
  // segments (det = 0) leave s free; a parameter cut off at an end determines the other one anew.
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

// Two capsules with the middle of a as origin.
struct CapsulePair {
  Capsule a, b;
  Vec3 u, w;  // their half axes
  Vec3 t;     // the middle of b

  double radii() const { return a.radius + b.radius; }
  double sine() const { return norm(cross(u, w)) / (a.half_length * b.half_length); }
};

// The way out where the axes cross is perpendicular to both.
Vec3 normal_of_crossing_axes(const CapsulePair& p, const Quat& rotation_a) {
  const Vec3 normal = p.sine() > 1e-6 ? normalised(cross(p.u, p.w)) : rotate(rotation_a, {1, 0, 0});
  return dot(normal, p.t) > 0 ? -normal : normal;
}

// The points of a's axis, in units of length along it, between which b lies beside it.
std::pair<double, double> common_length(const CapsulePair& p, const Vec3& along) {
  const double middle = dot(along, p.t), half = std::abs(dot(along, p.w));
  return {std::max(-p.a.half_length, middle - half), std::min(p.a.half_length, middle + half)};
}

}  // namespace

void collide_capsules(const Posed& posed_a, const Posed& posed_b, double margin,
                      std::vector<ContactPoint>& points) {
  const Capsule &a = std::get<Capsule>(posed_a.shape), &b = std::get<Capsule>(posed_b.shape);
  const Transform &frame_a = posed_a.frame, &frame_b = posed_b.frame;
  const CapsulePair p{a, b, rotate(frame_a.rotation, {0, 0, a.half_length}),
                      rotate(frame_b.rotation, {0, 0, b.half_length}), frame_b.position - frame_a.position};
  const double radii = p.radii(), reach = radii + margin;
  const auto [s, r] = nearest_parameters(p.u, p.w, p.t);
  const Vec3 offset = s * p.u - p.t - r * p.w;
  const double distance = norm(offset);
  if (distance > reach) return;
  const Vec3 normal =
      distance > 1e-12 * radii ? offset / distance : normal_of_crossing_axes(p, frame_a.rotation);
  const auto add = [&](const Vec3& on_axis_a, double gap) {
    if (gap <= margin)
      points.push_back({frame_a.position + on_axis_a - (a.radius + 0.5 * gap) * normal, normal, gap});
  };
  // Side by side they touch along a line: at both its ends, each with its own gap, and at the nearest point
  // too where the axes are so far from parallel that this lies clearly deeper.
  constexpr double parallel = 0.1;
  if (distance > 0.5 * radii && p.sine() < parallel) {
    const Vec3 along = p.u / a.half_length;
    const auto [begin, end] = common_length(p, along);
    if (end - begin > 1e-3 * std::min(a.half_length, b.half_length)) {
      double least = 2 * reach;
      for (double z : {begin, end}) {
        const Vec3 on_a = z * along;
        const double q = std::clamp(dot(p.w, on_a - p.t) / dot(p.w, p.w), -1.0, 1.0);
        const double gap = norm(on_a - p.t - q * p.w) - radii;
        least = std::min(least, gap);
        add(on_a, gap);
      }
      if (least - (distance - radii) <= 1e-3 * radii) return;
    }
  }
  add(s * p.u, distance - radii);
}

}  // namespace amontons::collision
