// A hull on a plane has hundreds of corners within a margin, a box on bumpy ground one per triangle. Each
// costs the same row in a solve, even if it is redundant. Three kinds of points are kept, with heights (gaps)
// over the plane across the normal:
//   1. the lowest one, now and at the end of the step;
//   2. the support polygon: the corners of the convex outline of the points as low as the lowest, without
//      those that add next to nothing to its area (M. Visvalingam, J. D. Whyatt, Line generalisation by
//      repeated elimination of points, 1993: the corner with the smallest triangle goes first);
//   3. the points that would be lowest if the body turned a little about any axis in the plane: those that
//      minimise  height - slope <direction, (u, v)>  for eight directions and slopes of all sizes, if no
//      kept point comes near.
// A turn adds a linear function to the heights, which changes 2 and 3 only by their range of heights: the
// kept points change little when a body rocks.
#include "amontons/collision/narrow/support_points.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "amontons/base/elementary.hpp"

namespace amontons {

namespace {

// Corners (count): as many as a round cap has. A regular dodecagon covers 95 % of its circle.
constexpr std::size_t most_corners = 12;
// Area (relative): corners that together add less are omitted.
constexpr double least_area = 0.01;
// Lift of one side of the support by the tested turns (tolerances). It ranges from the possible lift in one
// step down to one that separates the three points on which a body stands from those that it nearly stands
// on.
constexpr double parts[] = {10, 1, 0.1, 0.01, 0.001};
// Height (tolerances): the points on which a resting body stands are in one plane up to this.
constexpr double standing = 1e-3;
// Depth (relative to such a lift): by which a body may sink in for lack of a point.
constexpr double missed = 0.1;
// rounding (relative): smaller differences are ignored. held_alike (tolerances): a kept point that is higher
// by less replaces the lowest one.
constexpr double rounding = 1e-6, held_alike = 1e-2;

// Twice the area of a triangle, positive if it runs counter-clockwise.
double area(const auto& a, const auto& b, const auto& c) {
  return (b.u - a.u) * (c.v - a.v) - (c.u - a.u) * (b.v - a.v);
}

}  // namespace

// The lowest point. Among points that are equal within rounding a kept one is preferred, otherwise the first.
const SupportPoints::Site& SupportPoints::lowest(double tolerance,
                                                 std::span<const unsigned char> kept) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Site& s : sites_) least = std::min(least, s.height);
  const double alike = least + rounding * tolerance;
  const auto find = [&](auto&& wanted) { return std::find_if(sites_.begin(), sites_.end(), wanted); };
  const auto known =
      find([&](const Site& s) { return kept[s.point] && s.height <= least + held_alike * tolerance; });
  return known != sites_.end() ? *known : *find([&](const Site& s) { return s.height <= alike; });
}

// The convex outline of flat_, counter-clockwise (A. M. Andrew, Another efficient algorithm for convex hulls
// in two dimensions, 1979): along the lower side to the right, then back along the upper one.
void SupportPoints::make_outline() {
  std::sort(flat_.begin(), flat_.end(), [](const Site& a, const Site& b) {
    return a.u != b.u ? a.u < b.u : a.v != b.v ? a.v < b.v : a.point < b.point;
  });
  outline_.clear();
  const auto add = [&](const Site& s, std::size_t fixed) {
    while (outline_.size() >= fixed + 2 && !(area(outline_.end()[-2], outline_.back(), s) > 0))
      outline_.pop_back();
    outline_.push_back(s);
  };
  for (const Site& s : flat_) add(s, 0);
  const std::size_t lower = outline_.size() - 1;
  for (std::size_t k = flat_.size() - 1; k-- > 0;) add(flat_[k], lower);
  if (outline_.size() > 1) outline_.pop_back();  // the first corner again
}

// Among corners with equal loss the last one found goes first. Removing a corner changes only the loss of its
// two neighbours.
void SupportPoints::simplify_outline() {
  double whole = 0, lost = 0;
  for (std::size_t k = 2; k < outline_.size(); ++k) whole += area(outline_[0], outline_[k - 1], outline_[k]);
  const auto loss = [&](std::size_t k) {
    const std::size_t n = outline_.size(), before = k > 0 ? k - 1 : n - 1, after = k + 1 < n ? k + 1 : 0;
    return std::abs(area(outline_[before], outline_[k], outline_[after]));
  };
  losses_.resize(outline_.size());
  for (std::size_t k = 0; k < outline_.size(); ++k) losses_[k] = loss(k);
  while (outline_.size() > 3) {
    const std::size_t n = outline_.size();
    const double least = *std::min_element(losses_.begin(), losses_.end());
    if (n <= most_corners && !(lost + least <= least_area * whole)) return;
    std::size_t last = n;
    for (std::size_t k = 0; k < n; ++k)
      if (losses_[k] <= least + rounding * whole && (last == n || outline_[k].point > outline_[last].point))
        last = k;
    lost += least;
    outline_.erase(outline_.begin() + static_cast<std::ptrdiff_t>(last));
    losses_.erase(losses_.begin() + static_cast<std::ptrdiff_t>(last));
    const std::size_t after = last < n - 1 ? last : 0, before = last > 0 ? last - 1 : n - 2;
    losses_[before] = loss(before);
    losses_[after] = loss(after);
  }
}

void SupportPoints::keep_outline(double tolerance, std::span<unsigned char> kept) {
  const double limit = lowest(tolerance, kept).height + tolerance;
  flat_.clear();
  for (const Site& s : sites_)
    if (s.height <= limit) flat_.push_back(s);
  make_outline();
  simplify_outline();
  for (const Site& s : outline_) kept[s.point] = 1;
}

// Keeps points up to `height` over the lowest one, at a slope that lifts one side of them by as much.
void SupportPoints::keep_under_turns(double height, std::span<unsigned char> kept) {
  const Site& base = lowest(height, kept);
  kept[base.point] = 1;
  near_.clear();
  Site farthest{};
  double squared = 0;
  for (const Site& s : sites_) {
    if (!(s.height <= base.height + height)) continue;
    const Site& place = near_.emplace_back(Site{s.u - base.u, s.v - base.v, s.height, s.point});
    const double distance = place.u * place.u + place.v * place.v;
    if (!(distance > squared)) continue;
    squared = distance;
    farthest = place;
  }
  const double width = elementary::hypot(farthest.u, farthest.v);
  if (!(width > 0)) return;
  const double slope = height / width, half = std::sqrt(0.5);
  const double around[8][2] = {{1, 0},  {half, half},   {0, 1},  {-half, half},
                               {-1, 0}, {-half, -half}, {0, -1}, {half, -half}};
  for (const auto& [cu, cv] : around) {
    double least = base.height, held = base.height;  // of all points, of the kept ones
    std::uint32_t best = base.point;
    for (const Site& s : near_) {
      const double h = s.height - slope * (cu * s.u + cv * s.v);
      if (kept[s.point]) held = std::min(held, h);
      if (!(h < least - rounding * height)) continue;
      least = h;
      best = s.point;
    }
    if (least < held - missed * height) kept[best] = 1;
  }
}

void SupportPoints::select(std::span<const SupportPoint> points, const Vec3& normal, double tolerance,
                           std::span<unsigned char> kept) {
  if (points.empty()) return;
  const Quat frame = rotation_to_z(normal);
  const Vec3 u = rotate(frame, {1, 0, 0}), v = rotate(frame, {0, 1, 0}), &origin = points[0].point;
  sites_.clear();
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const Vec3 d = points[i].point - origin;
    sites_.push_back({dot(u, d), dot(v, d), points[i].gap, i});
  }
  keep_outline(tolerance, kept);
  keep_outline(standing * tolerance, kept);
  for (double part : parts) keep_under_turns(part * tolerance, kept);
  // More roughly for the end of the step: there the search is repeated after the solve.
  for (Site& s : sites_) s.height = points[s.point].end;
  keep_under_turns(parts[0] * tolerance, kept);
}

}  // namespace amontons
