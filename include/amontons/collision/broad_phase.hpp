#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

using IndexPair = std::pair<std::int32_t, std::int32_t>;  // first < second

// All pairs of boxes that overlap (touching counts), sorted, each once; boxes may be infinite (planes).
// `fixed[i]`: two fixed boxes are no pair. Near-linear time for boxes of any mix of sizes. The object keeps
// its scratch memory, and the order in space that it found last, between calls: that saves time when boxes
// have moved little, but pairs never depend on earlier calls.
class BroadPhase {
 public:
  void find_pairs(std::span<const Aabb> boxes, std::span<const unsigned char> fixed,
                  std::vector<IndexPair>& pairs);

 private:
  static constexpr int width = 8;  // children of a node
  // The boxes of up to eight children, child by child in each row: lower x, y, z, upper x, y, z.
  struct alignas(32) Node {
    float bound[6][width];
  };
  struct Item {
    float centre[3], extent[3];
    std::int32_t box;
  };

  void set_aside_infinite(std::span<const Aabb> boxes);
  void build(std::span<const Aabb> boxes);
  void split(std::size_t first, std::size_t last);
  void fit(std::span<const Aabb> boxes);
  bool search(std::span<const unsigned char> fixed, std::size_t limit);
  void cross_self(std::span<const unsigned char> fixed, std::size_t g);
  void cross(std::span<const unsigned char> fixed, std::size_t g, std::size_t h, const Node& parent,
             std::size_t child);
  void cross_leaf(std::span<const unsigned char> fixed, std::size_t g, int i, std::size_t h, unsigned which);
  void add_pairs_of_infinite(std::span<const Aabb> boxes, std::span<const unsigned char> fixed);
  void add(std::int32_t a, std::int32_t b, const Aabb& box_a, const Aabb& box_b,
           std::span<const unsigned char> fixed);
  void sort(std::size_t boxes, std::vector<IndexPair>& pairs);

  std::vector<std::int32_t> infinite_,
      last_infinite_;                      // boxes outside the tree, of this call and of the order
  std::vector<std::int32_t> finite_;       // the others
  std::vector<std::int32_t> order_;        // leaf -> box, -1 in gaps
  std::vector<std::vector<Node>> levels_;  // levels_[0]: the groups of eight leaves; the last level: one node
  std::vector<Aabb> boxes_;                // in the order of the leaves
  Vec3 origin_;                            // subtracted before coordinates are rounded to float
  std::size_t built_for_ = 0;              // the number of boxes that the order is for
  std::size_t visits_ = 0,
              built_visits_ = 0;  // nodes looked at by this search, by the one after the last build
  std::vector<IndexPair> found_;  // not sorted
  std::vector<Item> items_;
  std::vector<std::size_t> count_, start_;
};

}  // namespace amontons
