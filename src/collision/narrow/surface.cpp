#include "collision/narrow/surface.hpp"

#include <algorithm>
#include <cmath>

namespace amontons::collision {
namespace {

// Points closer than this part of the body's size are one: triangles that share an
// edge or corner both find it.
constexpr double same_point = 1e-5;
// Of more points than this with about the same normal some are left out.
constexpr std::size_t many = 16;
constexpr double same_normal = 0.99;  // cosine

bool is_deeper(const ContactPoint& a, const ContactPoint& b) { return a.gap < b.gap; }

// Of points that lie together with about the same normal the deepest one stays, in the place of the first.
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
    const double angle = 2 * 3.14159265358979323846 * static_cast<double>(k) / many;
    const Vec3 direction = rotate(frame, {std::cos(angle), std::sin(angle), 0});
    std::size_t best = first;
    for (std::size_t i = first; i < last; ++i)
      if (dot(direction, points[i].point) > dot(direction, points[best].point)) best = i;
    if (best < end) continue;
    std::iter_swap(at(best), at(end));
    ++end;
  }
  return end;
}

}  // namespace

void reduce_points(std::vector<ContactPoint>& points, std::size_t first, double length) {
  remove_doubles(points, first, length);
  if (points.size() - first <= many) return;
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
