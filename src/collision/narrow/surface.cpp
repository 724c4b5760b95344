#include "collision/narrow/surface.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace amontons::collision {
namespace {

// Points closer than this part of the body's size are one: triangles that share an edge or corner both find
// it, each with rounding of its own.
constexpr double same_point = 1e-5;
// Of more points than this with about the same normal some are left out: a body on a finely triangulated bump
// would else have a contact per triangle, which costs the solver more than it tells it. Sixteen outermost
// ones and the deepest hold the width of the area to 2 % (1 - cos(pi / 16)).
constexpr std::size_t many = 16;
// About 8 degrees: less than the edges of a body or of the ground turn by, more than a fine mesh from one
// triangle to the next.
constexpr double same_normal = 0.99;  // cosine

// Gaps are negative where the bodies overlap.
bool is_deeper(const ContactPoint& a, const ContactPoint& b) { return a.gap < b.gap; }

// Each point is compared with all that stay: a body on a surface has tens of points, not thousands. Of points
// that lie together with about the same normal the deepest one stays, in the place of the first.
void remove_doubles(std::vector<ContactPoint>& points, std::size_t first, double length) {
  const double tolerance = same_point * length;
  std::size_t end = first;
  for (std::size_t i = first; i < points.size(); ++i) {
    std::size_t j = first;
    while (j < end && !(norm_squared(points[i].point - points[j].point) <= tolerance * tolerance &&
                        dot(points[i].normal, points[j].normal) > same_normal))
      ++j;
    if (j == end)
      points[end++] = points[i];
    else if (is_deeper(points[i], points[j]))
      points[j] = points[i];
  }
  points.resize(end);
}

// Moves the points to keep of [first, last) to its front: the deepest and those farthest out in sixteen
// directions across the normal. Returns the end of them.
std::size_t select(std::vector<ContactPoint>& points, std::size_t first, std::size_t last) {
  const auto at = [&](std::size_t i) { return points.begin() + static_cast<std::ptrdiff_t>(i); };
  std::iter_swap(at(first), std::min_element(at(first), at(last), is_deeper));
  const Quat frame = rotation_to_z(points[first].normal);
  std::size_t end = first + 1;
  for (std::size_t k = 0; k < many && end < last; ++k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) / many;
    const Vec3 direction = rotate(frame, {std::cos(angle), std::sin(angle), 0});
    std::size_t best = first;
    for (std::size_t i = first; i < last; ++i)
      if (dot(direction, points[i].point) > dot(direction, points[best].point)) best = i;
    if (best >= end) std::iter_swap(at(best), at(end++));
  }
  return end;
}

// The origin of the shape, which lies inside all shapes but hulls: for those the mean of the corners.
Vec3 point_inside(const Shape& shape, const Quat& rotation) {
  const auto* hull = std::get_if<Hull>(&shape);
  if (!hull) return {};
  Vec3 mean;
  for (const Vec3& v : hull->data->vertices) mean += v / static_cast<double>(hull->data->vertices.size());
  return rotate(rotation, mean);
}

}  // namespace

// `box` is in the coordinates of the surface, which finds its triangles by it; all else is about the origin
// of the shape.
SurfaceBody::SurfaceBody(const Shape& shape, const Transform& frame, double margin_)
    : convex(make_convex(shape, frame, frame.position)),
      local(bounds(shape, {})),
      inside(point_inside(shape, frame.rotation)),
      origin(frame.position),
      box(bounds(shape, frame)),
      margin(margin_) {
  const Vec3 reach{margin, margin, margin};
  box.lower -= reach;
  box.upper += reach;
}

// In place, and in the order in which the points were found: first the doubles, then group by group.
void reduce_points(std::vector<ContactPoint>& points, std::size_t first, double length) {
  remove_doubles(points, first, length);
  if (points.size() - first <= many) return;
  // A body in a corner has contacts with several faces, each of which needs points of its own.
  // Groups of about the same normal as the first point that is in none yet.
  std::size_t out = first;
  for (std::size_t group = first; group < points.size();) {
    const Vec3 normal = points[group].normal;
    const auto begin = points.begin() + static_cast<std::ptrdiff_t>(group);
    const auto end = std::partition(
        begin, points.end(), [&](const ContactPoint& p) { return dot(p.normal, normal) > same_normal; });
    const auto next = static_cast<std::size_t>(end - points.begin());
    const std::size_t kept = next - group > many ? select(points, group, next) : next;
    for (std::size_t i = group; i < kept; ++i) points[out++] = points[i];
    group = next;
  }
  points.resize(out);
}

}  // namespace amontons::collision
