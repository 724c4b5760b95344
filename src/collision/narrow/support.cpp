#include <algorithm>
#include <cmath>

#include "collision/narrow/convex.hpp"

namespace amontons::collision {

namespace {

// A face supports a direction within acos(0.95), 18 degrees, of its normal, and an edge or a generator one
// within 17 degrees of the perpendicular: what is further tilted than that has left the margin before it
// matters, and a clipped sliver of a steep face is no contact area.
constexpr double face_cosine = 0.95, edge_sine = 0.3;
// A capsule keeps both its end points up to here: its flat view is never thin, so nothing is lost by more.
constexpr double segment_sine = 0.5;
constexpr int cap_corners = 12;

Vec3 to_local(const Convex& body, const Vec3& v) {
  return {dot(body.axis[0], v), dot(body.axis[1], v), dot(body.axis[2], v)};
}
Vec3 to_common(const Convex& body, const Vec3& v) {
  return v.x * body.axis[0] + v.y * body.axis[1] + v.z * body.axis[2];
}
Vec3 corner_of(const Convex& body, std::int32_t i) {
  return body.centre + to_common(body, body.hull->vertices[static_cast<std::size_t>(i)]);
}

// The corner of the hull that is extreme along a direction in its own frame: over all of them, or for large
// ones uphill along the edges, where a local maximum of a linear function on a convex body is the maximum.
std::int32_t extreme_corner(const ConvexHull& hull, const Vec3& direction) {
  constexpr std::size_t few = 48;
  std::int32_t best = 0;
  double height = dot(hull.vertices[0], direction);
  if (hull.vertices.size() <= few) {
    for (std::size_t i = 1; i < hull.vertices.size(); ++i) {
      const double h = dot(hull.vertices[i], direction);
      if (h > height) height = h, best = static_cast<std::int32_t>(i);
    }
    return best;
  }
  for (bool higher = true; higher;) {
    higher = false;
    for (std::int32_t j : hull.neighbours[static_cast<std::size_t>(best)]) {
      const double h = dot(hull.vertices[static_cast<std::size_t>(j)], direction);
      if (h > height) height = h, best = j, higher = true;
    }
  }
  return best;
}

void set_point(Feature& feature, const Vec3& p) {
  feature.count = 1;
  feature.points[0] = p;
}
void set_edge(Feature& feature, const Vec3& p, const Vec3& q) {
  feature.count = 2;
  feature.points[0] = p;
  feature.points[1] = q;
}

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
    const double side = d[flat] < 0 ? -1 : 1;
    const int i = (flat + 1) % 3, j = (flat + 2) % 3;
    const Vec3 m = body.centre + corner[flat] * body.axis[flat];
    const Vec3 u = side * body.size[i] * body.axis[i], v = body.size[j] * body.axis[j];
    feature.count = 4;
    feature.normal = side * body.axis[flat];
    feature.points[0] = m + u + v;
    feature.points[1] = m - u + v;
    feature.points[2] = m - u - v;
    feature.points[3] = m + u - v;
    return;
  }
  const Vec3 p = body.centre + to_common(body, corner);
  if (std::abs(d[along]) > edge_sine) return set_point(feature, p);
  set_edge(feature, p, p - 2 * corner[along] * body.axis[along]);
}

// A cap as a regular polygon inscribed in its rim; where it is tilted, with the rim's extreme point besides.
void cap_feature(const Convex& body, const Vec3& direction, double c, const Vec3* phase, Feature& feature) {
  const double side = c < 0 ? -1 : 1;
  const Vec3 n = side * body.axis[2], m = body.centre + side * body.size.z * body.axis[2];
  Vec3 e = body.axis[0];
  if (phase) {
    const Vec3 flat = *phase - dot(*phase, n) * n;
    if (norm_squared(flat) > 0.01) e = normalised(flat);
  }
  const Vec3 f = cross(n, e);
  const Vec3 down = direction - std::abs(c) * n;
  const double tilt = norm(down);
  double angle = -1;  // of the extreme point, in sides of the polygon; none within 1 mrad of flat
  if (tilt > 1e-3) {
    angle = std::atan2(dot(down, f), dot(down, e)) * (cap_corners / 6.283185307179586);
    if (angle < 0) angle += cap_corners;
  }
  static const auto circle = [] {
    std::array<std::array<double, 2>, cap_corners> table;
    for (int k = 0; k < cap_corners; ++k) {
      const double a = 6.283185307179586 * k / cap_corners;
      table[static_cast<std::size_t>(k)] = {std::cos(a), std::sin(a)};
    }
    return table;
  }();
  feature.count = 0;
  feature.normal = n;
  for (int k = 0; k < cap_corners; ++k) {
    const auto& point = circle[static_cast<std::size_t>(k)];
    feature.points[feature.count++] = m + body.size.x * (point[0] * e + point[1] * f);
    if (angle >= k && angle < k + 1)
      feature.points[feature.count++] = m + (body.size.x / tilt) * (down - dot(down, n) * n);
  }
}

void cylinder_feature(const Convex& body, const Vec3& direction, const Vec3* phase, Feature& feature) {
  const double c = dot(body.axis[2], direction);
  if (std::abs(c) >= face_cosine) return cap_feature(body, direction, c, phase, feature);
  const Vec3 radial = body.size.x * normalised(direction - c * body.axis[2]);
  const Vec3 half = (c < 0 ? -body.size.z : body.size.z) * body.axis[2];
  if (std::abs(c) > edge_sine) return set_point(feature, body.centre + radial + half);
  set_edge(feature, body.centre + radial + half, body.centre + radial - half);
}

void hull_feature(const Convex& body, const Vec3& direction, const Vec3* through, Feature& feature) {
  const ConvexHull& hull = *body.hull;
  const Vec3 d = to_local(body, direction);
  const std::int32_t extreme = extreme_corner(hull, d);
  const Vec3& top = hull.vertices[static_cast<std::size_t>(extreme)];
  const Vec3 held = through ? to_local(body, *through - body.centre) : top;
  const double tolerance = 1e-6 * body.extent;
  double best = face_cosine;
  std::size_t face = hull.faces.size();
  for (std::size_t f = 0; f < hull.faces.size(); ++f) {
    const double c = dot(hull.normals[f], d);
    if (c > best && (std::abs(dot(hull.normals[f], held) - hull.offsets[f]) <= tolerance)) best = c, face = f;
  }
  if (face < hull.faces.size()) {
    const auto& corners = hull.faces[face];
    const std::size_t n = corners.size(), kept = std::min<std::size_t>(n, Feature::capacity - 1);
    feature.count = static_cast<int>(kept);
    feature.normal = to_common(body, hull.normals[face]);
    for (std::size_t k = 0; k < kept; ++k) feature.points[k] = corner_of(body, corners[k * n / kept]);
    return;
  }
  std::int32_t other = -1;
  double slope = -edge_sine;
  for (std::int32_t j : hull.neighbours[static_cast<std::size_t>(extreme)]) {
    const Vec3 edge = hull.vertices[static_cast<std::size_t>(j)] - top;
    const double s = dot(edge, d) / norm(edge);
    if (s > slope) slope = s, other = j;
  }
  if (other < 0) return set_point(feature, corner_of(body, extreme));
  set_edge(feature, corner_of(body, extreme), corner_of(body, other));
}

void triangle_feature(const Convex& body, const Vec3& direction, Feature& feature) {
  const Vec3 n = normalised(cross(body.corner[1] - body.corner[0], body.corner[2] - body.corner[0]));
  const double c = dot(n, direction);
  if (std::abs(c) >= face_cosine) {
    const bool front = c > 0;
    feature.count = 3;
    feature.normal = front ? n : -n;
    feature.points[0] = body.corner[0];
    feature.points[1] = body.corner[front ? 1 : 2];
    feature.points[2] = body.corner[front ? 2 : 1];
    return;
  }
  int extreme = 0, other = -1;
  for (int i = 1; i < 3; ++i)
    if (dot(body.corner[i] - body.corner[extreme], direction) > 0) extreme = i;
  double slope = -edge_sine;
  for (int i = 0; i < 3; ++i) {
    if (i == extreme) continue;
    const Vec3 edge = body.corner[i] - body.corner[extreme];
    const double s = dot(edge, direction) / norm(edge);
    if (s > slope) slope = s, other = i;
  }
  if (other < 0) return set_point(feature, body.corner[extreme]);
  set_edge(feature, body.corner[extreme], body.corner[other]);
}

}  // namespace

Convex make_convex(const Shape& shape, const Transform& frame, const Vec3& origin) {
  Convex body;
  body.centre = frame.position - origin;
  const Mat3 rotation = to_matrix(frame.rotation);
  for (int i = 0; i < 3; ++i) body.axis[i] = rotation.column(i);
  if (const auto* hull = std::get_if<Hull>(&shape)) {
    body.kind = Convex::Kind::hull;
    body.hull = hull->data.get();
    body.extent = hull->data->extent;
    return body;
  }
  body.extent = bounding_radius(shape);
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    body.kind = Convex::Kind::point;
    body.radius = sphere->radius;
  } else if (const auto* capsule = std::get_if<Capsule>(&shape)) {
    body.kind = Convex::Kind::segment;
    body.radius = capsule->radius;
    body.size = {0, 0, capsule->half_length};
  } else if (const auto* box = std::get_if<Box>(&shape)) {
    body.kind = Convex::Kind::box;
    body.size = box->half;
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
    body.kind = Convex::Kind::cylinder;
    body.size = {cylinder->radius, cylinder->radius, cylinder->half_length};
  } else {
    body.kind = Convex::Kind::ellipsoid;
    body.size = std::get<Ellipsoid>(shape).radii;
  }
  return body;
}

Convex make_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  Convex body;
  body.kind = Convex::Kind::triangle;
  body.centre = (1.0 / 3) * (a + b + c);
  body.corner[0] = a;
  body.corner[1] = b;
  body.corner[2] = c;
  for (const Vec3& corner : body.corner) body.extent = std::max(body.extent, norm(corner - body.centre));
  return body;
}

Vec3 support(const Convex& body, const Vec3& direction) {
  switch (body.kind) {
    case Convex::Kind::point:
      return body.centre;
    case Convex::Kind::segment:
      return body.centre + (dot(body.axis[2], direction) < 0 ? -body.size.z : body.size.z) * body.axis[2];
    case Convex::Kind::triangle: {
      const double a = dot(body.corner[0], direction), b = dot(body.corner[1], direction),
                   c = dot(body.corner[2], direction);
      return a >= b ? body.corner[a >= c ? 0 : 2] : body.corner[b >= c ? 1 : 2];
    }
    case Convex::Kind::box: {
      const Vec3 d = to_local(body, direction);
      return body.centre + to_common(body, {std::copysign(body.size.x, d.x), std::copysign(body.size.y, d.y),
                                            std::copysign(body.size.z, d.z)});
    }
    case Convex::Kind::cylinder: {
      const Vec3 d = to_local(body, direction);
      const double flat = std::sqrt(d.x * d.x + d.y * d.y);
      // Along the axis the whole cap is extreme: its centre, which is no corner, would be as good as any.
      const double s = flat > 0 ? body.size.x / flat : 0;
      return body.centre + to_common(body, {s * d.x, s * d.y, std::copysign(body.size.z, d.z)});
    }
    case Convex::Kind::ellipsoid: {
      const Vec3 d = to_local(body, direction);
      const Vec3 scaled{body.size.x * d.x, body.size.y * d.y, body.size.z * d.z};
      const double s = 1 / norm(scaled);
      return body.centre + to_common(body, {s * scaled.x * body.size.x, s * scaled.y * body.size.y,
                                            s * scaled.z * body.size.z});
    }
    case Convex::Kind::hull:
      break;
  }
  return corner_of(body, extreme_corner(*body.hull, to_local(body, direction)));
}

void supporting_feature(const Convex& body, const Vec3& direction, const Vec3* through, const Vec3* phase,
                        Feature& feature) {
  switch (body.kind) {
    case Convex::Kind::point:
      return set_point(feature, body.centre + body.radius * direction);
    case Convex::Kind::segment: {
      const double c = dot(body.axis[2], direction);
      const Vec3 p = body.centre + body.radius * direction;
      const Vec3 half = (c < 0 ? -body.size.z : body.size.z) * body.axis[2];
      return std::abs(c) > segment_sine ? set_point(feature, p + half)
                                        : set_edge(feature, p + half, p - half);
    }
    case Convex::Kind::triangle:
      return triangle_feature(body, direction, feature);
    case Convex::Kind::box:
      return box_feature(body, direction, feature);
    case Convex::Kind::cylinder:
      return cylinder_feature(body, direction, phase, feature);
    case Convex::Kind::ellipsoid:
      return set_point(feature, support(body, direction));
    case Convex::Kind::hull:
      return hull_feature(body, direction, through, feature);
  }
}

}  // namespace amontons::collision
