#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "amontons/base/host_array.hpp"
#include "amontons/collision/shapes/aabb.hpp"

namespace amontons {

// Two boxes by their numbers.
using IndexPair = std::pair<std::int32_t, std::int32_t>;  // first < second

// A second bound, of spheres: two of them whose boxes overlap are mostly apart.
struct Ball {
  Vec3 centre;
  double radius;  // infinite: none
};

// The box of a ball that travels.
inline Aabb box_around(const Ball& ball, const Vec3& travel) {
  Aabb box;
  for (int i = 0; i < 3; ++i) {
    box.lower[i] = ball.centre[i] - ball.radius + std::min(0.0, travel[i]);
    box.upper[i] = ball.centre[i] + ball.radius + std::max(0.0, travel[i]);
  }
  return box;
}

// Whether balls touch, or come to touch by their travels along their present normal n. Either the distance d
// is at most the sum of the radii, or d + n . travel is. Both are multiplied by d. Also true where one has no
// bound.
inline bool may_touch(const Ball& a, const Vec3& travel_a, const Ball& b, const Vec3& travel_b) {
  const Vec3 apart = a.centre - b.centre;
  const double closing = std::min(0.0, dot(apart, travel_a - travel_b)), squared = norm_squared(apart);
  return !(squared + closing > (a.radius + b.radius) * std::sqrt(squared));
}

// Boxes among which pairs are searched. Each has a ball and how far its centre travels within the step (m).
// That of a ball with a bound is box_around().
struct Bounds {
  std::span<const Aabb> boxes;  // may be infinite: planes
  std::span<const Ball> balls;
  std::span<const Vec3> travels;
  std::span<const unsigned char> fixed;  // two fixed ones form no pair; where all are, a search costs nothing
  std::uint64_t placed = 0;              // equal numbers: equal balls; 0: of one search
};

// A number that nothing else has: of balls, of an order. Who keeps a copy knows by it whether it still holds.
std::uint64_t next_number();

// Finite boxes in an order in which neighbours in space are mostly neighbours: eight leaves make a group,
// eight groups a node, and so on.
struct BoxOrder {
  Bounds bounds;                         // all, infinite ones as well
  std::span<const std::int32_t> leaves;  // leaf -> box, -1 in gaps; a multiple of eight
  Vec3 origin;                           // amid the boxes, for who rounds coordinates to float
  std::uint64_t number;                  // equal numbers: equal leaves
};

// A search outside of this library, on a device, for at least so many finite boxes. Several searches may run
// at a time.
struct PairSearch {
  std::size_t least = 0;
  HostMemory memory = {};  // for balls and travels, from which it reads fastest
  // Appends the pairs that BroadPhase::find_pairs() states for these boxes, in any order, and returns a
  // measure of its work, which tells when an order is out of date. It may throw.
  std::function<std::size_t(const BoxOrder&, std::vector<IndexPair>&)> find;
};

// All pairs of boxes that overlap and whose balls do (touching counts), sorted, each once. Near-linear time
// for boxes of any mix of sizes. Scratch memory and the last spatial order are kept between calls. That saves
// time when boxes have moved little, but pairs never depend on earlier calls, nor on who searches, nor on the
// number of threads (0: one per core).
class BroadPhase {
 public:
  void find_pairs(const Bounds& bounds, std::vector<IndexPair>& pairs, const PairSearch* outside = nullptr,
                  unsigned threads = 1);

 private:
  static constexpr int width = 8;  // children of a node
  // The boxes of up to eight children, child by child in each row: lower x, y, z, upper x, y, z. Bit k of
  // `moves`: some box of child k is not fixed.
  struct alignas(32) Node {
    float bound[6][width];
    unsigned moves;
  };
  // Pairs that one part of a search has found, not sorted, and the nodes that it has visited.
  struct Found {
    std::vector<IndexPair> pairs;
    std::size_t visits = 0;
  };
  // A leaf during the search for an order; box -1: a gap that fills the last group of a class.
  struct Item {
    float centre[3], extent[3];
    std::int32_t box;
  };

  // The order of the leaves. Neighbours in space should be neighbours in the order, because eight consecutive
  // leaves share a node.
  void set_aside_infinite(std::span<const Aabb> boxes);
  void build(std::span<const Aabb> boxes);
  void choose_origin(std::span<const Aabb> boxes);
  void sort_by_size(std::span<const Aabb> boxes);
  void split(std::size_t first, std::size_t last);
  int best_axis(std::size_t first, std::size_t last) const;

  // The tree over them, and its pairs. g, h: numbers of groups of eight leaves.
  bool search(const PairSearch* outside, std::size_t limit, unsigned threads);
  void fit(std::span<const Aabb> boxes);
  bool search_groups(std::size_t limit, unsigned threads);
  void cross_later_groups(std::size_t g, Found& found) const;
  void cross(std::size_t g, std::size_t h, Found& found) const;
  void cross_leaf(std::size_t g, int i, std::size_t h, unsigned which, Found& found) const;
  void add_pairs_of_infinite(std::span<const Aabb> boxes);
  void add(std::int32_t a, std::int32_t b, const Aabb& box_a, const Aabb& box_b, Found& found) const;
  void sort(std::size_t boxes, std::vector<IndexPair>& pairs);

  // Data of the current call.
  Bounds bounds_;                          // given by the caller
  std::vector<std::int32_t> infinite_;     // boxes outside the tree, ascending
  std::vector<std::int32_t> finite_;       // the others, ascending
  std::vector<std::vector<Node>> levels_;  // levels_[0]: the groups of eight leaves; the last level: one node
  std::vector<Aabb> boxes_;                // in the order of the leaves
  Found found_;                            // of all parts
  std::vector<Found> parts_;               // of a search by threads

  // The last order that was built. It only affects the time of the search, so it may be of any age.
  std::vector<std::int32_t> order_;  // leaf -> box, -1 in gaps
  Vec3 origin_;                      // subtracted before coordinates are rounded to float
  std::size_t built_for_ = 0;        // the number of boxes
  std::vector<std::int32_t> last_infinite_;
  std::size_t built_visits_ = 0;  // of the first search in this order
  bool built_outside_ = false;    // who counted them
  std::uint64_t number_ = 0;      // of the order, among all searches

  // Scratch.
  std::vector<Item> items_;
  std::vector<std::size_t> count_, start_;
};

}  // namespace amontons
