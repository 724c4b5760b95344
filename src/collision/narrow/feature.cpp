#include "collision/narrow/feature.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "amontons/base/elementary.hpp"

// The supporting feature of a body along a direction. The support function gives one extreme point. A
// manifold needs all nearly extreme points, because a box that is tilted by rounding still rests on a face.
// The thresholds below decide between face, edge and point; they are angles, which hold in any unit. They are
// wide on purpose: a feature that is too large only gives points beyond the margin, which clipping drops; one
// that is too small loses a support.
namespace amontons::collision {

namespace {

// An edge or a generator supports a direction within 17 degrees of the perpendicular (face_cosine: faces).
constexpr double edge_sine = 0.3;
// A capsule keeps both its end points up to this limit: they form no thin area, so a wide limit loses
// nothing.
constexpr double segment_sine = 0.5;

// In the box's own axes the components of the direction are the cosines to its faces. The feature is a face
// if one component dominates, an edge along the axis whose component is small, otherwise the corner with the
// signs of the direction.
void box_feature(const Convex& body, const Vec3& direction, Feature& feature) {
  const Vec3 d = to_local(body, direction);
  int flat = 0, along = 0;  // the axes nearest to the direction, and most perpendicular to it
  for (int i = 1; i < 3; ++i) {
    if (std::abs(d[i]) > std::abs(d[flat])) flat = i;
    if (std::abs(d[i]) < std::abs(d[along])) along = i;
  }
  Vec3 corner;
  for (int i = 0; i < 3; ++i) corner[i] = d[i] < 0 ? -body.size[i] : body.size[i];
  if (std::abs(d[flat]) >= face_cosine) {
    // (flat, i, j) is right-handed; on the side where the axis points inwards u is reversed, to keep the
    // orientation.
    const double side = d[flat] < 0 ? -1 : 1;
    const int i = (flat + 1) % 3, j = (flat + 2) % 3;
    const Vec3 m = body.centre + corner[flat] * body.axis[flat];
    const Vec3 u = side * body.size[i] * body.axis[i], v = body.size[j] * body.axis[j];
    feature.normal = side * body.axis[flat];
    return feature.set({m + u + v, m - u + v, m - u - v, m + u - v});
  }
  const Vec3 p = body.centre + to_common(body, corner);
  if (std::abs(d[along]) > edge_sine) return feature.set({p});
  feature.set({p, p - 2 * corner[along] * body.axis[along]});
}

// The direction of a cap's first corner, perpendicular to its normal n: along `phase` unless that is normal
// to the cap or null.
Vec3 cap_phase(const Convex& body, const Vec3& n, const Vec3* phase) {
  if (!phase) return body.axis[0];
  const Vec3 flat = *phase - dot(*phase, n) * n;
  return norm_squared(flat) > 0.01 ? normalised(flat) : body.axis[0];
}

// Clipping needs polygons, so a cap is a regular polygon inscribed in its rim, and if the cap is tilted also
// the rim's extreme point. c: the cosine between the body's axis and the direction.
void cap_feature(const Convex& body, const Vec3& direction, double c, const Vec3* phase, Feature& feature) {
  const double side = c < 0 ? -1 : 1;
  const Vec3 n = side * body.axis[2], m = body.centre + side * body.size.z * body.axis[2];
  const Vec3 e = cap_phase(body, n, phase), f = cross(n, e);
  const Vec3 down = direction - std::abs(c) * n;  // part of the direction along the cap
  const double tilt = norm(down);
  double angle = -1;  // of the extreme point, in sides of the polygon; -1 within 1 mrad of flat
  if (tilt > 1e-3) {
    angle = elementary::atan2(dot(down, f), dot(down, e)) * (cap_corners / 6.283185307179586);
    if (angle < 0) angle += cap_corners;
  }
  // On a tilted cap the exact extreme point is inserted in the order of the corners. So the deepest point of
  // a rocking drum is never lost between two corners.
  feature.count = 0;
  feature.normal = n;
  for (int k = 0; k < cap_corners; ++k) {
    feature.points[feature.count++] = m + body.size.x * (cap_polygon()[k][0] * e + cap_polygon()[k][1] * f);
    if (angle >= k && angle < k + 1)
      feature.points[feature.count++] = m + (body.size.x / tilt) * (down - dot(down, n) * n);
  }
}

// A cap, a generator of the side (the straight line that is extreme along the direction), or a point of the
// rim.
void cylinder_feature(const Convex& body, const Vec3& direction, const Vec3* phase, Feature& feature) {
  const double c = dot(body.axis[2], direction);
  if (std::abs(c) >= face_cosine) return cap_feature(body, direction, c, phase, feature);
  const Vec3 radial = body.size.x * normalised(direction - c * body.axis[2]);
  const Vec3 half = (c < 0 ? -body.size.z : body.size.z) * body.axis[2];
  if (std::abs(c) > edge_sine) return feature.set({body.centre + radial + half});
  feature.set({body.centre + radial + half, body.centre + radial - half});
}

// Finds the face best aligned with the direction d (in the hull's frame) that contains a point, if one is
// close to it. The best aligned one need not be next to the extreme corner, so that all faces near the
// direction are tested. The first of equally aligned ones is taken.
bool hull_face(const Convex& body, const Vec3& d, const Vec3& held, Feature& feature) {
  const ConvexHull& hull = *body.hull;
  const double tolerance = 1e-6 * body.extent;
  double best = face_cosine;
  std::size_t face = hull.faces.size();
  for (std::int32_t f : faces_towards(hull, d)) {
    const double c = dot(hull.normals[f], d);
    if (c > best && std::abs(dot(hull.normals[f], held) - hull.offsets[f]) <= tolerance) {
      best = c;
      face = static_cast<std::size_t>(f);
    }
  }
  if (face == hull.faces.size()) return false;
  // A face of many corners is reduced evenly.
  const auto& corners = hull.faces[face];
  const std::size_t n = corners.size(), kept = std::min<std::size_t>(n, Feature::capacity - 1);
  feature.count = static_cast<int>(kept);
  feature.normal = to_common(body, hull.normals[face]);
  for (std::size_t k = 0; k < kept; ++k) feature.points[k] = corner_of(body, corners[k * n / kept]);
  return true;
}

// The slope of an edge is the sine of the angle by which it falls from the plane across the direction. Among
// the corners `others` that edges join to the extreme one, finds the one that falls least along the
// direction. It forms an edge with the extreme corner, unless the edge is too steep, which leaves a point.
// `at`: the place of a corner.
void edge_or_point(int extreme, const auto& others, const Vec3& direction, Feature& feature, auto&& at) {
  int other = -1;
  double slope = -edge_sine;
  for (int j : others) {
    const Vec3 edge = at(j) - at(extreme);
    const double s = dot(edge, direction) / norm(edge);
    if (s > slope) {
      slope = s;
      other = j;
    }
  }
  feature.count = other < 0 ? 1 : 2;
  feature.points[0] = at(extreme);
  if (other >= 0) feature.points[1] = at(other);
}

// A face, otherwise the feature at the extreme corner.
void hull_feature(const Convex& body, const Vec3& direction, const Vec3* through, Feature& feature) {
  const ConvexHull& hull = *body.hull;
  const Vec3 d = to_local(body, direction);
  const std::int32_t extreme = extreme_corner(hull, d);
  const Vec3 held = through ? to_local(body, *through - body.centre) : hull.vertices[extreme];
  if (hull_face(body, d, held, feature)) return;
  edge_or_point(extreme, hull.neighbours[extreme], d, feature,
                [&](int i) -> const Vec3& { return hull.vertices[i]; });
  for (int i = 0; i < feature.count; ++i)
    feature.points[i] = body.centre + to_common(body, feature.points[i]);
}

// The same for a triangle; either side may be the face.
void triangle_feature(const Convex& body, const Vec3& direction, Feature& feature) {
  const Vec3 *corner = body.corner, n = normalised(cross(corner[1] - corner[0], corner[2] - corner[0]));
  const double c = dot(n, direction);
  if (std::abs(c) >= face_cosine) {
    const bool front = c > 0;
    feature.normal = front ? n : -n;
    return feature.set({corner[0], corner[front ? 1 : 2], corner[front ? 2 : 1]});
  }
  int extreme = 0;
  for (int i = 1; i < 3; ++i)
    if (dot(corner[i] - corner[extreme], direction) > 0) extreme = i;
  const int others[] = {extreme == 0 ? 1 : 0, extreme == 2 ? 1 : 2};
  edge_or_point(extreme, others, direction, feature, [&](int i) -> const Vec3& { return corner[i]; });
}

}  // namespace

const CapPolygon& cap_polygon() {
  static const CapPolygon polygon = [] {
    CapPolygon table;
    for (int k = 0; k < cap_corners; ++k) {
      const double a = 6.283185307179586 * k / cap_corners;
      table[k] = {elementary::cos(a), elementary::sin(a)};
    }
    return table;
  }();
  return polygon;
}

// A capsule is represented by its generator along the direction. A shape that is curved everywhere, such as
// an ellipsoid, needs no case: only its extreme point supports it.
void supporting_feature(const Convex& body, const Vec3& direction, const Vec3* through, const Vec3* phase,
                        Feature& feature) {
  switch (body.kind) {
    case Convex::Kind::point:
      return feature.set({body.centre + body.radius * direction});
    case Convex::Kind::segment: {
      const double c = dot(body.axis[2], direction);
      const Vec3 p = body.centre + body.radius * direction;
      const Vec3 half = (c < 0 ? -body.size.z : body.size.z) * body.axis[2];
      if (std::abs(c) > segment_sine) return feature.set({p + half});
      return feature.set({p + half, p - half});
    }
    case Convex::Kind::triangle:
      return triangle_feature(body, direction, feature);
    case Convex::Kind::box:
      return box_feature(body, direction, feature);
    case Convex::Kind::cylinder:
      return cylinder_feature(body, direction, phase, feature);
    case Convex::Kind::hull:
      return hull_feature(body, direction, through, feature);
    default:
      return feature.set({support(body, direction)});
  }
}

}  // namespace amontons::collision
