#include "collision/narrow/surface.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace amontons::collision {
namespace {

// Distance (relative to the body's size) below which points are one: triangles that share an edge or corner
// both find it, each with its own rounding.
constexpr double same_point = 1e-5;
// About 8 degrees: less than the angle at edges of a body or of the ground, more than that between triangles
// of a fine mesh.
constexpr double same_normal = 0.99;  // cosine

// Position of points along a direction that is not aligned with any grid: coincident points are neighbours in
// this order, and few others are.
struct Place {
  double along;
  std::uint32_t point;
};
constexpr Vec3 askew{0.5773, 0.5138, 0.6346};

}  // namespace

bool SurfaceBody::separate_by_face(const Convex& triangle, const Vec3& n, double limit, Separation& s) const {
  if (convex.kind != Convex::Kind::box) return false;
  const Vec3 d = to_local(convex, n);
  int flat = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(d[i]) > std::abs(d[flat])) flat = i;
  // The face is opposite to n. Heights are over it, outwards.
  const double side = d[flat] > 0 ? -1 : 1;
  int nearest = 0;
  double height[3];
  for (int k = 0; k < 3; ++k) {
    height[k] = side * dot(convex.axis[flat], triangle.corner[k] - convex.centre) - convex.size[flat];
    if (height[k] < height[nearest]) nearest = k;
  }
  if (!(height[nearest] >= 0)) return false;
  const Vec3 at = to_local(convex, triangle.corner[nearest] - convex.centre);
  for (int i = 0; i < 3; ++i)
    if (i != flat && !(std::abs(at[i]) <= convex.size[i])) return false;
  s.distance = height[nearest];
  s.within = s.distance <= limit;
  s.normal = -side * convex.axis[flat];
  s.on_b = triangle.corner[nearest];
  s.on_a = s.on_b + s.distance * s.normal;
  return true;
}

// Among coincident points with about the same normal the deepest one stays, at the index of the first. In
// place and in the order of discovery; the cost is that of sorting.
void remove_doubles(std::vector<ContactPoint>& points, std::size_t first, double length) {
  thread_local std::vector<Place> places;
  thread_local std::vector<std::uint32_t> order, slot;
  const double tolerance = same_point * length;
  const std::size_t n = points.size() - first;
  places.resize(n);
  order.resize(n);
  slot.assign(n, 0xffffffff);  // for a remaining point: its present place, from `first` on
  for (std::uint32_t i = 0; i < n; ++i) places[i] = {dot(askew, points[first + i].point), i};
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.along != b.along ? a.along < b.along : a.point < b.point;
  });
  for (std::uint32_t k = 0; k < n; ++k) order[places[k].point] = k;
  std::uint32_t end = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    const ContactPoint p = points[first + i];
    std::uint32_t same = end;
    const auto is_in_range = [&](std::size_t k) {
      // A slot may hold a point from the other end of the tolerance.
      if (std::abs(places[k].along - places[order[i]].along) > 2 * tolerance) return false;
      const std::uint32_t j = slot[places[k].point];
      if (j < same && norm_squared(p.point - points[first + j].point) <= tolerance * tolerance &&
          dot(p.normal, points[first + j].normal) > same_normal)
        same = j;
      return true;
    };
    for (std::size_t k = order[i] + 1; k < n && is_in_range(k); ++k) {
    }
    for (std::size_t k = order[i]; k-- > 0 && is_in_range(k);) {
    }
    if (same == end) {
      slot[i] = end;
      points[first + end++] = p;
    } else if (p.gap < points[first + same].gap) {
      points[first + same] = p;  // deeper, as gaps are negative for overlaps
    }
  }
  points.resize(first + end);
}

namespace {

// The origin of the shape, which is inside all shapes except hulls.
Vec3 point_inside(const Shape& shape, const Quat& rotation) {
  const auto* hull = std::get_if<Hull>(&shape);
  return hull ? rotate(rotation, hull->data->middle) : Vec3{};
}

}  // namespace

// `box` is in the coordinates of the surface, which uses it to find triangles; all else is relative to the
// origin of the shape.
SurfaceBody::SurfaceBody(const Shape& shape, const Transform& frame, double margin_)
    : convex(make_convex(shape, frame, frame.position)),
      local(quick_bounds(shape, {})),
      inside(point_inside(shape, frame.rotation)),
      origin(frame.position),
      box(bounds(shape, frame)),
      margin(margin_) {
  const Vec3 reach{margin, margin, margin};
  box.lower -= reach;
  box.upper += reach;
}

}  // namespace amontons::collision
