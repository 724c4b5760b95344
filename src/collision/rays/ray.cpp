// Rays against shapes: closed forms for primitives, half spaces for hulls, triangles for surfaces.
#include "amontons/collision/rays/ray.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "collision/shapes/height_grid.hpp"
#include "collision/shapes/triangle_mesh.hpp"

namespace amontons {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Vec3 at(const Ray& ray, double t) { return ray.origin + t * ray.direction; }

// Keeps the nearer of a hit and a candidate ahead of the ray's origin.
void keep(RayHit& hit, double t, const Vec3& normal) {
  if (t >= 0 && t < hit.distance) hit = {t, normal};
}

// The hit of a ray that is inside a convex body from `enter` to `leave`.
RayHit of_interval(double enter, const Vec3& enter_normal, double leave, const Vec3& leave_normal) {
  if (!(enter <= leave) || leave < 0) return {};
  return enter >= 0 ? RayHit{enter, enter_normal} : RayHit{leave, leave_normal};
}

// The roots of |o + t d|^2 = r^2, smaller first; false if there are none. With the line's point nearest to
// the centre, m = o + b d, the discriminant is r^2 - |m|^2 and does not cancel for a distant origin.
bool roots(const Vec3& o, const Vec3& d, double radius, std::array<double, 2>& t) {
  const double dd = dot(d, d);
  if (dd == 0) return false;
  const double b = -dot(o, d) / dd;
  const double left = radius * radius - norm_squared(o + b * d);
  if (left < 0) return false;
  const double half = std::sqrt(left / dd);
  t = {b - half, b + half};
  return true;
}

RayHit cast(const Sphere& sphere, const Ray& ray) {
  std::array<double, 2> t;
  if (!roots(ray.origin, ray.direction, sphere.radius, t)) return {};
  RayHit hit;
  for (const double root : t) keep(hit, root, at(ray, root) / sphere.radius);
  return hit;
}

// In coordinates divided by the semi-axes it is the unit sphere; the gradient of the form is the normal.
RayHit cast(const Ellipsoid& ellipsoid, const Ray& ray) {
  const Vec3& r = ellipsoid.radii;
  const auto over = [&](const Vec3& v) { return Vec3{v.x / r.x, v.y / r.y, v.z / r.z}; };
  std::array<double, 2> t;
  if (!roots(over(ray.origin), over(ray.direction), 1, t)) return {};
  RayHit hit;
  for (const double root : t) keep(hit, root, normalised(over(over(at(ray, root)))));
  return hit;
}

// The curved side of a cylinder about z.
void keep_side(const Ray& ray, double radius, double half_length, RayHit& hit) {
  const Vec3 o{ray.origin.x, ray.origin.y, 0}, d{ray.direction.x, ray.direction.y, 0};
  std::array<double, 2> t;
  if (!roots(o, d, radius, t)) return;
  for (const double root : t)
    if (std::abs(at(ray, root).z) <= half_length) keep(hit, root, (o + root * d) / radius);
}

RayHit cast(const Cylinder& cylinder, const Ray& ray) {
  RayHit hit;
  keep_side(ray, cylinder.radius, cylinder.half_length, hit);
  if (ray.direction.z == 0) return hit;
  for (const double sign : {-1.0, 1.0}) {
    const double t = (sign * cylinder.half_length - ray.origin.z) / ray.direction.z;
    const Vec3 p = at(ray, t);
    if (p.x * p.x + p.y * p.y <= cylinder.radius * cylinder.radius) keep(hit, t, {0, 0, sign});
  }
  return hit;
}

RayHit cast(const Capsule& capsule, const Ray& ray) {
  RayHit hit;
  keep_side(ray, capsule.radius, capsule.half_length, hit);
  for (const double sign : {-1.0, 1.0}) {
    const Vec3 centre{0, 0, sign * capsule.half_length};
    std::array<double, 2> t;
    if (!roots(ray.origin - centre, ray.direction, capsule.radius, t)) continue;
    for (const double root : t) {
      const Vec3 from = at(ray, root) - centre;
      if (sign * from.z >= 0) keep(hit, root, from / capsule.radius);
    }
  }
  return hit;
}

// A convex body as half spaces <n, p> <= offset: the ray's interval is the intersection of those of all.
struct Clip {
  double enter = -infinity, leave = infinity;
  Vec3 enter_normal, leave_normal;

  void add(const Vec3& normal, double offset, const Ray& ray) {
    const double speed = dot(normal, ray.direction), gap = offset - dot(normal, ray.origin);
    if (speed == 0) {
      if (gap < 0) leave = -infinity;
      return;
    }
    const double t = gap / speed;
    if (speed < 0 && t > enter) {
      enter = t;
      enter_normal = normal;
    } else if (speed > 0 && t < leave) {
      leave = t;
      leave_normal = normal;
    }
  }
  RayHit hit() const { return of_interval(enter, enter_normal, leave, leave_normal); }
};

RayHit cast(const Box& box, const Ray& ray) {
  Clip clip;
  for (int i = 0; i < 3; ++i)
    for (const double sign : {-1.0, 1.0}) {
      Vec3 normal;
      normal[i] = sign;
      clip.add(normal, box.half[i], ray);
    }
  return clip.hit();
}

RayHit cast(const Hull& hull, const Ray& ray) {
  Clip clip;
  for (std::size_t f = 0; f < hull.data->normals.size(); ++f)
    clip.add(hull.data->normals[f], hull.data->offsets[f], ray);
  return clip.hit();
}

RayHit cast(const Plane&, const Ray& ray) {
  RayHit hit;
  if (ray.direction.z < 0) keep(hit, -ray.origin.z / ray.direction.z, {0, 0, 1});
  return hit;
}

// By the side on which the ray passes each edge, the sign of a volume. Two triangles compute the same number
// with opposite signs at their common edge, to the last bit: no ray passes between them.
void keep_triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal, const Ray& ray,
                   RayHit& hit) {
  const Vec3 oa = a - ray.origin, ob = b - ray.origin, oc = c - ray.origin;
  const double u = dot(ray.direction, cross(oa, ob)), v = dot(ray.direction, cross(ob, oc)),
               w = dot(ray.direction, cross(oc, oa));
  if (!((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0))) return;
  if (const double speed = dot(normal, ray.direction); speed != 0) keep(hit, dot(normal, oa) / speed, normal);
}

// The interval [enter, leave] of the ray in a box; empty if enter > leave. Slightly wider than the box, so
// that rounding loses nothing on its faces.
std::array<double, 2> interval(const Aabb& box, const Ray& ray) {
  std::array<double, 2> t{0, infinity};
  for (int i = 0; i < 3; ++i) {
    const double room = 1e-12 * (std::abs(box.lower[i]) + std::abs(box.upper[i]) + std::abs(ray.origin[i]));
    const double below = box.lower[i] - room - ray.origin[i], above = box.upper[i] + room - ray.origin[i];
    if (ray.direction[i] == 0) {
      if (below > 0 || above < 0) return {infinity, -infinity};
      continue;
    }
    const double t0 = below / ray.direction[i], t1 = above / ray.direction[i];
    t[0] = std::max(t[0], std::min(t0, t1));
    t[1] = std::min(t[1], std::max(t0, t1));
  }
  return t;
}

// Descends the tree through boxes that the ray enters before the nearest hit so far.
RayHit cast(const Mesh& shape, const Ray& ray) {
  const TriangleMesh& mesh = *shape.data;
  RayHit hit;
  const auto enters = [&](const Aabb& box) {
    const auto [enter, leave] = interval(box, ray);
    return enter <= leave && enter <= hit.distance;
  };
  collision::MeshSurface{mesh}.for_each(enters, [&](std::int32_t t) {
    keep_triangle(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), mesh.normals[t], ray, hit);
  });
  return hit;
}

// Column by column: between two lines of the grid the ray passes a range of rows, often one or two. A ray
// along a grid line may be on either side of it by rounding, so the range is wider by `room`, in cells.
RayHit cast(const HeightField& field, const Ray& ray) {
  const HeightGrid& grid = *field.data;
  const collision::GridSurface surface{grid};
  const auto [enter, leave] = interval(grid.box(), ray);
  // Distance (cells): rounding of a ray along a grid line.
  constexpr double room = 1e-9;
  RayHit hit;
  if (enter > leave) return hit;
  const auto column = [&](double t) { return surface.column_at(at(ray, t).x); };
  const auto row = [&](double t) { return surface.row_at(at(ray, t).y); };
  const auto columns =
      collision::GridSurface::cells(std::min(column(enter), column(leave)) - room,
                                    std::max(column(enter), column(leave)) + room, grid.columns - 2);
  const double speed = ray.direction.x / grid.size_x * static_cast<double>(grid.columns - 1);
  for (std::int64_t n = 0; n <= columns[1] - columns[0]; ++n) {
    const std::int64_t c = speed >= 0 ? columns[0] + n : columns[1] - n;
    // From the line where the ray enters the column to the one where it leaves.
    double t0 = enter, t1 = leave;
    if (speed != 0) {
      const double origin = surface.column_at(ray.origin.x);
      const double a = (static_cast<double>(c) - origin) / speed,
                   b = (static_cast<double>(c + 1) - origin) / speed, more = room / std::abs(speed);
      t0 = std::max(t0, std::min(a, b) - more);
      t1 = std::min(t1, std::max(a, b) + more);
    }
    if (t0 > hit.distance) break;
    const auto rows = collision::GridSurface::cells(std::min(row(t0), row(t1)) - room,
                                                    std::max(row(t0), row(t1)) + room, grid.rows - 2);
    for (std::int64_t r = rows[0]; r <= rows[1]; ++r)
      for (int upper = 0; upper < 2; ++upper) {
        const Vec3 p = surface.point(r, c), q = surface.point(r + 1, c + 1),
                   s = upper ? surface.point(r + 1, c) : surface.point(r, c + 1);
        const Vec3 &second = upper ? q : s, &third = upper ? s : q;
        keep_triangle(p, second, third, collision::GridSurface::normal_of(p, second, third), ray, hit);
      }
  }
  return hit;
}

}  // namespace

RayHit cast_ray(const Shape& shape, const Ray& ray) {
  return std::visit([&](const auto& s) { return cast(s, ray); }, shape);
}

RayHit cast_ray(const Shape& shape, const Transform& frame, const Ray& ray) {
  const Quat back = conjugate(frame.rotation);
  RayHit hit = cast_ray(shape, {rotate(back, ray.origin - frame.position), rotate(back, ray.direction)});
  hit.normal = rotate(frame.rotation, hit.normal);
  return hit;
}

}  // namespace amontons
