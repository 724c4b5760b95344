#include "collision/pairs/plane.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "collision/narrow/convex.hpp"
#include "collision/narrow/feature.hpp"

// Shapes on a half space. The gap of a point p is its height <n, p - at> over the plane. This is linear, so
// that the gap of a convex shape is the least one of its extreme points, and no search is needed. Each point
// of a shape is a valid constraint of its own. So every corner within the margin is taken that has a face
// looking down: no choice between faces can lose one.
namespace amontons::collision {

namespace {

// A face within 6 degrees of upright still counts as a wall: a box that rocks by less keeps its four corners.
constexpr double looks_down = -0.1;  // cosine; the walls of an upright box do not count

// Cosine of the angle between corners of a cap, a twelfth of a turn.
constexpr double beside_lowest = 0.8661;

// The plane and the parameters of the query; `at` is any point of the plane.
struct PlaneContact {
  Vec3 at, normal;
  double margin;
  std::vector<ContactPoint>& points;

  // Height over the plane, negative below it.
  double height(const Vec3& p) const { return dot(normal, p - at); }
  // Adds a point of the shape if it is near enough; the contact is half-way to the plane.
  void add(const Vec3& p) const {
    const double gap = height(p);
    if (gap <= margin) points.push_back({p - (0.5 * gap) * normal, normal, gap});
  }
};

// A box that lies flat has the four lower corners: each of the upper four has a face that looks up and two
// upright ones.
void box_on_plane(const Box& box, const Transform& frame, const PlaneContact& plane) {
  const Mat3 r = to_matrix(frame.rotation);
  // A corner is omitted if all three of its faces look up: <column, normal> times the corner's sign.
  const Vec3 up = transposed(r) * plane.normal;
  for (int k = 0; k < 8; ++k) {
    // Ordered around the z faces: consecutive corners are neighbours.
    const Vec3 side{(k & 1) != (k >> 1 & 1) ? 1.0 : -1.0, k & 2 ? 1.0 : -1.0, k & 4 ? 1.0 : -1.0};
    if (side.x * up.x >= looks_down && side.y * up.y >= looks_down && side.z * up.z >= looks_down) continue;
    plane.add(frame.position + r * Vec3{side.x * box.half.x, side.y * box.half.y, side.z * box.half.z});
  }
}

// Both ends, each with its own gap: with them the capsule lies flat, or rolls over an end.
void capsule_on_plane(const Capsule& capsule, const Transform& frame, const PlaneContact& plane) {
  const Vec3 half = rotate(frame.rotation, {0, 0, capsule.half_length});
  const Vec3 down = frame.position - capsule.radius * plane.normal;
  plane.add(down - half);
  plane.add(down + half);
}

// The rim's lowest point of either cap, and for a cap that looks down a polygon on its rim. A cap that does
// not lie rolls on its rim, and comes to the corners beside its lowest point. They would brake it and are
// omitted. cap_feature() of such a cap is that point alone.
void cylinder_on_plane(const Cylinder& cylinder, const Transform& frame, const PlaneContact& plane) {
  const Mat3 r = to_matrix(frame.rotation);
  const Vec3 axis = r.column(2);
  const double c = dot(axis, plane.normal);
  const Vec3 flat = c * axis - plane.normal;  // down, in the plane of the caps
  const double tilt = norm(flat);
  for (double side : {-1.0, 1.0}) {
    const Vec3 cap = frame.position + (side * cylinder.half_length) * axis;
    // The rim's lowest point, unless the cap is within 1 mrad of flat, where its position is arbitrary.
    if (tilt > 1e-3) plane.add(cap + (cylinder.radius / tilt) * flat);
    if (side * c >= looks_down) continue;
    for (const auto& [cosine, sine] : cap_polygon()) {
      const Vec3 corner = cosine * r.column(0) + sine * r.column(1);
      if (-side * c < face_cosine && dot(corner, flat) > beside_lowest * tilt) continue;
      plane.add(cap + cylinder.radius * corner);
    }
  }
}

// The corners of a hull up to a height over the plane, ascending, where heights are <up, p> + lift. Few
// corners are all tested. Otherwise the walk begins at the lowest one and goes on along the edges. A linear
// function on a convex body falls along edges from every corner to its minimum. So the corners below a height
// are connected.
const std::vector<std::int32_t>& corners_below(const ConvexHull& hull, const Vec3& up, double lift,
                                               double height) {
  thread_local std::vector<std::int32_t> found;
  thread_local std::vector<std::uint64_t> seen;  // per corner: the last walk that reached it
  thread_local std::uint64_t walk = 0;
  const auto is_low = [&](std::size_t i) { return !(dot(up, hull.vertices[i]) + lift > height); };
  const std::size_t n = hull.vertices.size();
  found.clear();
  if (n <= few_corners) {
    for (std::size_t i = 0; i < n; ++i)
      if (is_low(i)) found.push_back(static_cast<std::int32_t>(i));
    return found;
  }
  ++walk;
  if (seen.size() < n) seen.resize(n, 0);
  const auto reach = [&](std::int32_t i) {
    if (std::exchange(seen[i], walk) != walk && is_low(static_cast<std::size_t>(i))) found.push_back(i);
  };
  reach(extreme_corner(hull, -up));
  for (std::size_t k = 0; k < found.size(); ++k)
    for (std::int32_t j : hull.neighbours[found[k]]) reach(j);
  std::sort(found.begin(), found.end());
  return found;
}

// In the hull's own frame, where heights over the plane are <up, p> + lift.
void hull_on_plane(const ConvexHull& hull, const Transform& frame, const PlaneContact& plane) {
  const Vec3 up = rotate(conjugate(frame.rotation), plane.normal);
  const double lift = plane.height(frame.position);
  // Most hulls of a robot are far above its floor: the lowest corner of their box gives a quick test.
  const Vec3 lowest{up.x > 0 ? hull.box.lower.x : hull.box.upper.x,
                    up.y > 0 ? hull.box.lower.y : hull.box.upper.y,
                    up.z > 0 ? hull.box.lower.z : hull.box.upper.z};
  if (dot(up, lowest) + lift > plane.margin) return;
  for (std::int32_t i : corners_below(hull, up, lift, plane.margin)) {
    // A corner of the upper side: an edge falls from it and none rises; level edges do not count.
    bool rises = false, falls = false;
    for (std::int32_t j : hull.neighbours[i]) {
      const Vec3 edge = hull.vertices[j] - hull.vertices[i];
      const double slope = dot(up, edge), level = -looks_down * norm(edge);
      rises = slope > level;
      falls |= slope < -level;
      if (rises) break;
    }
    if (rises || !falls) plane.add(frame(hull.vertices[i]));
  }
}

}  // namespace

// In coordinates of the world, except for hulls: they have many corners, and turning the plane into their
// frame costs one rotation.
void collide_plane(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const PlaneContact contact{b.frame.position, rotate(b.frame.rotation, {0, 0, 1}), margin, points};
  if (const auto* box = std::get_if<Box>(&a.shape)) return box_on_plane(*box, a.frame, contact);
  if (const auto* capsule = std::get_if<Capsule>(&a.shape))
    return capsule_on_plane(*capsule, a.frame, contact);
  if (const auto* drum = std::get_if<Cylinder>(&a.shape)) return cylinder_on_plane(*drum, a.frame, contact);
  if (const auto* hull = std::get_if<Hull>(&a.shape)) return hull_on_plane(*hull->data, a.frame, contact);
  // Spheres and ellipsoids: only the lowest point.
  const Convex body = make_convex(a.shape, a.frame, contact.at);
  contact.add(contact.at + support(body, -contact.normal) - body.radius * contact.normal);
}

}  // namespace amontons::collision
