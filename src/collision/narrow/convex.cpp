#include "collision/narrow/convex.hpp"

#include <algorithm>
#include <cmath>

namespace amontons::collision {

// A shape in the form of the algorithms: kind, axes and up to three lengths, so that support() is one switch
// over plain data without a virtual call. The core is the shape without a ball of the radius around every
// point: a point for a sphere, a segment for a capsule, the whole shape otherwise.
Convex make_convex(const Shape& shape, const Transform& frame, const Vec3& origin) {
  Convex body;
  body.centre = frame.position - origin;
  const Mat3 rotation = to_matrix(frame.rotation);
  for (int i = 0; i < 3; ++i) body.axis[i] = rotation.column(i);
  const auto make = [&](Convex::Kind kind, double extent, const Vec3& size, double radius = 0) {
    body.kind = kind;
    body.extent = extent;
    body.size = size;
    body.radius = radius;
    return body;
  };
  // A hull stores its extent; the radius about its origin would need a pass over the corners.
  if (const auto* hull = std::get_if<Hull>(&shape)) {
    body.hull = hull->data.get();
    return make(Convex::Kind::hull, body.hull->extent, {});
  }
  const double extent = bounding_radius(shape);
  if (const auto* s = std::get_if<Sphere>(&shape)) return make(Convex::Kind::point, extent, {}, s->radius);
  if (const auto* s = std::get_if<Capsule>(&shape))
    return make(Convex::Kind::segment, extent, {0, 0, s->half_length}, s->radius);
  if (const auto* s = std::get_if<Box>(&shape)) return make(Convex::Kind::box, extent, s->half);
  if (const auto* s = std::get_if<Cylinder>(&shape))
    return make(Convex::Kind::cylinder, extent, {s->radius, s->radius, s->half_length});
  return make(Convex::Kind::ellipsoid, extent, std::get<Ellipsoid>(shape).radii);
}

// A triangle has corners instead of axes: it is made again for every triangle near a body.
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

// Support of the core only. The radius is added once the distance of the cores is known, which keeps the
// algorithms exact for round bodies.
Vec3 support(const Convex& body, const Vec3& direction) {
  switch (body.kind) {
    case Convex::Kind::point:
      return body.centre;
    case Convex::Kind::segment:
      // One of the two ends; for a direction across the segment the upper one.
      return body.centre + (dot(body.axis[2], direction) < 0 ? -body.size.z : body.size.z) * body.axis[2];
    case Convex::Kind::triangle: {
      // The first of equal corners, so that the result does not depend on the order of comparisons.
      const double a = dot(body.corner[0], direction), b = dot(body.corner[1], direction),
                   c = dot(body.corner[2], direction);
      if (a >= b) return body.corner[a >= c ? 0 : 2];
      return body.corner[b >= c ? 1 : 2];
    }
    case Convex::Kind::box: {
      // Each coordinate is largest at the end that the direction points to.
      const Vec3 d = to_local(body, direction);
      return body.centre + to_common(body, {std::copysign(body.size.x, d.x), std::copysign(body.size.y, d.y),
                                            std::copysign(body.size.z, d.z)});
    }
    case Convex::Kind::cylinder: {
      // The rim point along the part of the direction across the axis, on the cap that the direction points
      // to.
      const Vec3 d = to_local(body, direction);
      const double flat = std::sqrt(d.x * d.x + d.y * d.y);
      // Along the axis the whole cap is extreme; its centre is not a corner but equally extreme.
      const double s = flat > 0 ? body.size.x / flat : 0;
      return body.centre + to_common(body, {s * d.x, s * d.y, std::copysign(body.size.z, d.z)});
    }
    case Convex::Kind::ellipsoid: {
      // The image of a ball under the stretch S by the semi-axes: S (S d / |S d|).
      const Vec3 d = to_local(body, direction);
      const Vec3 scaled{body.size.x * d.x, body.size.y * d.y, body.size.z * d.z};
      const double s = 1 / norm(scaled);
      return body.centre + to_common(body, {s * scaled.x * body.size.x, s * scaled.y * body.size.y,
                                            s * scaled.z * body.size.z});
    }
    // After the switch, so that the compiler sees a return on every path.
    case Convex::Kind::hull:
      break;
  }
  return corner_of(body, extreme_corner(*body.hull, to_local(body, direction)));
}

// Tolerances of shapes are relative to the smaller body: a pebble on a planet. The rounding of a difference
// of two points is 1e-16 of their coordinates, at most those of the far ends.
PairScale pair_scale(const Convex& a, const Convex& b) {
  return {std::min(a.extent, b.extent), a.extent + b.extent + norm(a.centre - b.centre)};
}

}  // namespace amontons::collision
