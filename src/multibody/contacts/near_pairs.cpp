#include "multibody/contacts/near_pairs.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "amontons/base/parts.hpp"

namespace amontons {

void Extents::resize(std::size_t geoms, const HostMemory& memory) {
  boxes.resize(geoms);
  balls.resize(geoms, memory);
  travels.resize(geoms, memory);
  half_spaces.resize(geoms);
}

bool Extents::meet_in_boxes(Index a, Index b) const {
  if (std::isfinite(balls[a].radius) && std::isfinite(balls[b].radius))
    return may_touch(balls[a], travels[a], balls[b], travels[b]);
  // That of other shapes has no normal, and reaches everything.
  const auto reaches = [&](Index plane, const Aabb& box) {
    const auto& [normal, top] = half_spaces[plane];
    Vec3 lowest;
    for (int i = 0; i < 3; ++i) lowest[i] = normal[i] > 0 ? box.lower[i] : box.upper[i];
    return !(dot(normal, lowest) > top);
  };
  return reaches(a, boxes[b]) && reaches(b, boxes[a]);
}

// Sums of a ball are rounded, and so they are compared with some room. All else is compared as it is used.
bool Extents::is_within(const Extents& other, std::size_t g) const {
  const Aabb &box = boxes[g], &around = other.boxes[g];
  for (int i = 0; i < 3; ++i)
    if (!(around.lower[i] <= box.lower[i] && box.upper[i] <= around.upper[i])) return false;
  const Ball& ball = balls[g];
  if (std::isfinite(ball.radius)) {
    const double reached = norm(ball.centre - other.balls[g].centre) + norm(travels[g]) + ball.radius;
    return with_rounding * reached <= other.balls[g].radius;
  }
  return half_spaces[g].normal == other.half_spaces[g].normal &&
         half_spaces[g].top <= other.half_spaces[g].top;
}

std::span<const IndexPair> NearPairs::find(const Reach& reach, const Subset& visited, const Extents& now,
                                           std::span<const GeomMotion> motions,
                                           std::span<const unsigned char> stay) {
  if (hold(reach, visited, now, stay)) return pairs_;
  const Model& model = reach.model;
  stay_.clear();  // no list until the search has ended
  grow(reach, now, motions);
  broad_phase_.find_pairs(grown_.bounds(stay), pairs_, reach.pairs, reach.threads);
  std::erase_if(pairs_, [&](const IndexPair& pair) {
    return !model.may_touch(pair.first, pair.second) || !grown_.meet(pair.first, pair.second);
  });
  stay_.assign(stay.begin(), stay.end());
  return pairs_;
}

bool NearPairs::hold(const Reach& reach, const Subset& visited, const Extents& now,
                     std::span<const unsigned char> stay) const {
  if (stay_.size() != stay.size()) return false;
  std::atomic<bool> all{true};
  const auto test = [&](std::size_t g) {
    if ((stay_[g] && !stay[g]) || !now.is_within(grown_, g)) all.store(false, std::memory_order_relaxed);
  };
  visited.each(stay.size(), test, reach.threads);
  return all;
}

// Let r be the radius of balls, and s their slack. A list has pairs in proportion to (1 + s / r)^3, and a
// search for it costs as much. Bodies need time in proportion to s to leave it: per time, searches cost least
// with s = r / 2. A geom that cannot move needs no slack. A body at rest counts with the velocity that its
// load gives it, and so it has room for what its support leaves. A large geom among small ones has no more
// slack than they have.
void NearPairs::grow(const Reach& reach, const Extents& now, std::span<const GeomMotion> motions) {
  grown_.resize(now.boxes.size(), reach.memory());
  grown_.placed = next_number();
  for_entries(reach.threads, now.boxes.size(), [&](std::size_t g) {
    const double travel = norm(now.travels[g]);
    const double radius = std::min(now.balls[g].radius, reach.model.length());
    const double slack = travel + motions[g].spin > 0 ? 0.5 * radius : 0;
    grown_.travels[g] = {};
    grown_.balls[g] = {now.balls[g].centre, with_rounding * (now.balls[g].radius + travel + slack)};
    grown_.half_spaces[g] = {now.half_spaces[g].normal, now.half_spaces[g].top + slack};
    if (std::isfinite(now.balls[g].radius)) {
      grown_.boxes[g] = box_around(grown_.balls[g], {});
      return;
    }
    const Vec3 by{slack, slack, slack};
    grown_.boxes[g] = {now.boxes[g].lower - by, now.boxes[g].upper + by};
  });
}

}  // namespace amontons
