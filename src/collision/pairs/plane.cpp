#include "collision/pairs/plane.hpp"

#include <cmath>

#include "amontons/base/elementary.hpp"
#include "collision/narrow/convex.hpp"

// Shapes on a half space. The gap of a point p is its height <n, p - at> over the plane. This is linear, so
// that the gap of a convex shape is the least one of its extreme points, and no search is needed. Each point
// of a shape is a valid constraint of its own. So every corner within the margin is taken that has a face
// looking down: no choice between faces can lose one.
namespace amontons::collision {

namespace {

// A face within 6 degrees of upright still counts as a wall: a box that rocks by less keeps its four corners.
constexpr double looks_down = -0.1;  // cosine; the walls of an upright box do not count

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

// The rim's lowest point of either cap, and for a cap that looks down a polygon on its rim.
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
    // Corners of the polygon on the rim, as in cap_feature() of narrow/feature.cpp.
    constexpr int corners = 12;
    for (int k = 0; k < corners; ++k) {
      const double angle = 6.283185307179586 * k / corners;
      plane.add(cap + cylinder.radius *
                          (elementary::cos(angle) * r.column(0) + elementary::sin(angle) * r.column(1)));
    }
  }
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
  for (std::size_t i = 0; i < hull.vertices.size(); ++i) {
    if (dot(up, hull.vertices[i]) + lift > plane.margin) continue;
    // A corner of the upper side: an edge falls from it and none rises; level edges do not count.
    bool rises = false, falls = false;
    for (std::int32_t j : hull.neighbours[i]) {
      const Vec3 edge = hull.vertices[j] - hull.vertices[i];
      const double slope = dot(up, edge), level = -looks_down * norm(edge);
      rises |= slope > level;
      falls |= slope < -level;
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
