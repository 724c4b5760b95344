#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "amontons/collision/broad_phase.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;

namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

struct Boxes {
  std::vector<Aabb> box;
  std::vector<unsigned char> fixed;
  double share = infinite;  // radius of the ball of every box but each fifth, of half its longest side
  double haste = 0;         // length of a ball's travel, of that half side
  std::vector<Ball> ball;
  std::vector<Vec3> travel;
  Bounds bounds() {
    ball.clear();
    travel.clear();
    for (std::size_t i = 0; i < box.size(); ++i) {
      const Vec3 half = 0.5 * (box[i].upper - box[i].lower);
      const double radius = std::max({half.x, half.y, half.z}), turn = static_cast<double>(i);
      ball.push_back({box[i].lower + half, i % 5 == 4 ? infinite : share * radius});
      travel.push_back(haste * radius * Vec3{std::cos(turn), std::sin(turn), std::cos(3 * turn)});
    }
    return {box, ball, travel, fixed};
  }
  void add(const Vec3& centre, const Vec3& half, bool is_fixed = false) {
    box.push_back({centre - half, centre + half});
    fixed.push_back(is_fixed);
  }
};

std::vector<IndexPair> brute_force(const Boxes& s) {
  std::vector<IndexPair> pairs;
  const auto n = static_cast<std::int32_t>(s.box.size());
  for (std::int32_t i = 0; i < n; ++i)
    for (std::int32_t j = i + 1; j < n; ++j) {
      bool overlap = !(s.fixed[i] && s.fixed[j]);
      for (int axis = 0; axis < 3; ++axis)
        overlap = overlap && s.box[i].lower[axis] <= s.box[j].upper[axis] &&
                  s.box[j].lower[axis] <= s.box[i].upper[axis];
      if (!overlap) continue;
      // The gap now, and at the end with the velocity along the normal of now.
      const Vec3 apart = s.ball[i].centre - s.ball[j].centre;
      const double distance = norm(apart), gap = distance - s.ball[i].radius - s.ball[j].radius;
      const double opens = distance > 0 ? dot(apart / distance, s.travel[i] - s.travel[j]) : 0;
      if (!(gap > 0 && gap + opens > 0)) pairs.emplace_back(i, j);  // not a number: no bound
    }
  return pairs;
}

// Sizes over `decades` powers of ten, lengths of the three edges over one more; every seventh is fixed.
Boxes random_mix(std::size_t count, double decades, unsigned seed, const Vec3& offset = {}) {
  small::Random random(seed);
  Boxes s;
  for (std::size_t i = 0; i < count; ++i) {
    const double size = 0.3 * std::pow(10, -decades * random.uniform(0, 1));
    Vec3 centre = offset, half;
    for (int axis = 0; axis < 3; ++axis) {
      centre[axis] += random.uniform(-3, 3);
      half[axis] = size * std::pow(10, -random.uniform(0, 1));
    }
    s.add(centre, half, i % 7 == 0);
  }
  return s;
}

void check_against_brute_force(BroadPhase& phase, Boxes s) {
  const auto bounds = s.bounds();  // which makes the balls, too
  const std::vector<IndexPair> expected = brute_force(s);
  std::vector<IndexPair> pairs{{7, 9}};  // rubbish that the call replaces
  for (const unsigned threads : {1u, 3u}) {
    phase.find_pairs(bounds, pairs, nullptr, threads);
    CHECK(pairs == expected);
  }
}

}  // namespace

// A wrong child mask, a group or a size class that is skipped, an order of leaves that misses or repeats one.
// Counts around multiples of eight and of powers of eight, where nodes are partly filled.
TEST(threads_find_random_mixes_as_brute_force) {
  for (std::size_t count : {0, 1, 2, 7, 8, 9, 63, 64, 65, 511, 513, 1500})
    for (double decades : {0.0, 1.0, 4.0, 12.0}) {
      BroadPhase phase;
      check_against_brute_force(phase, random_mix(count, decades, static_cast<unsigned>(count)));
    }
}

// Breaks when balls that touch are taken for apart, others for near, or those without a bound for small ones;
// when balls that approach are, or those that move side by side or away are taken for near.
TEST(threads_find_balls_as_brute_force) {
  for (double share : {0.1, 0.3, 0.6}) {
    std::size_t before = 0;
    for (double haste : {0.0, 0.6}) {
      BroadPhase phase;
      Boxes s = random_mix(3000, 1, 41);
      std::vector<IndexPair> all, near;
      phase.find_pairs(s.bounds(), all);
      s.share = share;
      s.haste = haste;
      phase.find_pairs(s.bounds(), near);
      CHECK(near.size() < all.size());
      CHECK(haste == 0 || near.size() > before);
      before = near.size();
      check_against_brute_force(phase, s);
    }
  }
  Boxes touch;
  touch.share = 1;
  // All three boxes touch the next one; the last two do so at an edge, where balls are apart.
  for (const Vec3& at : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{2, 1, 0}}) touch.add(at, {0.5, 0.5, 0.5});
  BroadPhase phase;
  std::vector<IndexPair> pairs;
  phase.find_pairs(touch.bounds(), pairs);
  CHECK((pairs == std::vector<IndexPair>{{0, 1}}));
}

// Groups of fixed boxes meet only those that move. Fails if a pair is lost where only the later of two groups
// holds a box that moves, or only one leaf of a group.
TEST(threads_find_few_boxes_that_move_among_fixed_ones) {
  for (std::size_t one_of : {2, 9, 50, 700}) {
    BroadPhase phase;
    Boxes s = random_mix(1500, 1, 4);
    for (std::size_t last : {0, 1, 5}) {
      for (std::size_t i = 0; i < s.fixed.size(); ++i) s.fixed[i] = i % one_of != last % one_of;
      check_against_brute_force(phase, s);
    }
  }
}

// Far from the origin floats resolve nothing: a pair is lost if rounding were not
// monotone or the shift missing.
TEST(far_from_the_origin) {
  for (double offset : {1e3, 1e6, 1e9, 1e12}) {
    BroadPhase phase;
    check_against_brute_force(phase, random_mix(600, 1, 5, {offset, -2 * offset, offset}));
  }
}

// Boxes that share exactly a face, an edge or a corner overlap; those one rounding apart do not.
TEST(touching_counts) {
  Boxes s;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j)
      for (int k = 0; k < 5; ++k) s.add({0.25 * i, 0.25 * j, 0.25 * k}, {0.125, 0.125, 0.125});
  BroadPhase phase;
  std::vector<IndexPair> pairs;
  phase.find_pairs(s.bounds(), pairs);
  // Pairs of neighbours in a 5^3 grid, diagonal ones too: (13^3 - 5^3) / 2, as 13 = 5 + 2 * 4 per axis.
  CHECK(pairs.size() == (13 * 13 * 13 - 125) / 2);
  CHECK(pairs == brute_force(s));
  Boxes apart;
  apart.box = {{{0, 0, 0}, {1, 1, 1}}, {{std::nextafter(1.0, 2.0), 0, 0}, {2, 1, 1}}};
  apart.fixed = {0, 0};
  phase.find_pairs(apart.bounds(), pairs);
  CHECK(pairs.empty());
}

// Planes in whole and in part infinite, a floor under everything, points, plates without thickness, boxes
// that coincide, and a box that is not a number, which overlaps nothing.
TEST(extreme_boxes) {
  Boxes s = random_mix(300, 2, 11);
  s.box.push_back({{-infinite, -infinite, -infinite}, {infinite, infinite, infinite}});
  s.box.push_back({{-infinite, -infinite, -infinite}, {infinite, infinite, 0}});
  s.box.push_back({{-infinite, -infinite, -infinite}, {infinite, infinite, infinite}});
  s.fixed.insert(s.fixed.end(), {1, 1, 0});
  s.add({0, 0, -1}, {1e6, 1e6, 1}, true);
  s.add({0, 0, 0}, {1e300, 1e300, 1e300});
  s.add({1e307, 0, 0}, {1e306, 1, 1});
  s.add({0.5, 0.5, 0.5}, {0, 0, 0});
  s.add({0.5, 0.5, 0.5}, {0, 0, 0});
  s.add({0.5, 0.5, 0.5}, {1, 1, 0});
  s.add({0, 0, 0}, {std::nan(""), 1, 1});
  s.add({0, 0, 0}, {5e-324, 5e-324, 5e-324});
  for (int i = 0; i < 40; ++i) s.add({1, 1, 1}, {0.5, 0.5, 0.5});
  BroadPhase phase;
  check_against_brute_force(phase, s);
  Boxes coincident;
  for (int i = 0; i < 100; ++i) coincident.add({3, 3, 3}, {0, 0, 0});
  check_against_brute_force(phase, coincident);
}

// The order in space is kept between calls: pairs must not depend on it when boxes move, jump, change their
// number or become infinite.
TEST(earlier_calls_leave_no_trace) {
  BroadPhase used;
  small::Random random(3);
  Boxes s = random_mix(400, 1, 21);
  for (int call = 0; call < 60; ++call) {
    const double jump = call % 10 == 9 ? 6 : 0.05;
    for (Aabb& box : s.box) {
      const Vec3 d{jump * random.uniform(-1, 1), jump * random.uniform(-1, 1), jump * random.uniform(-1, 1)};
      box.lower += d;
      box.upper += d;
    }
    if (call % 13 == 5) s.add({0, 0, 0}, {0.2, 0.2, 0.2});
    if (call % 13 == 7) {
      s.box.pop_back();
      s.fixed.pop_back();
    }
    if (call == 30) s.box[3].upper.z = infinite;
    check_against_brute_force(used, s);
  }
}

// The same scene in other units: the same pairs, by the same work (a length with a dimension inside would
// show in the time first; the pairs are the part that can be checked).
TEST(units_do_not_matter) {
  Boxes metres = random_mix(500, 2, 31);
  BroadPhase phase;
  std::vector<IndexPair> expected, pairs;
  phase.find_pairs(metres.bounds(), expected);
  for (double unit : {1e-3, 1e3, 0x1p-60, 0x1p60}) {
    Boxes scaled = metres;
    for (Aabb& box : scaled.box) {
      box.lower *= unit;
      box.upper *= unit;
    }
    check_against_brute_force(phase, scaled);
    phase.find_pairs(scaled.bounds(), pairs);
    if (unit == 0x1p-60 || unit == 0x1p60) CHECK(pairs == expected);
  }
}
