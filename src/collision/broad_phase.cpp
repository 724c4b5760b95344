#include "amontons/collision/broad_phase.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "amontons/base/parts.hpp"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

// The broad phase finds the overlapping pairs of n boxes in about n log n steps instead of n^2. It is a
// bounding volume hierarchy (Ericson, Real-Time Collision Detection, section 6.2), fitted again in every
// call, because all bodies move.
//
// A tree with eight children per node over the boxes, stored without pointers. Leaf k is in node k / 8 of
// level 0, in node k / 64 of level 1, and so on. The order of the leaves makes it a k-d tree. Ranges are
// split at the median of the centres, along the axis that shrinks the halves most, at multiples of powers of
// eight. Boxes of very different size are separated before that: a floor among bricks would make every node
// above it as large as the floor. So leaves are ordered by classes of size, small ones first.
//
// Each group of eight leaves then searches later groups that it overlaps. The result does not depend on the
// order of the leaves, so the order of the last call is used as long as it is efficient.
//
// The tree holds floats, eight of which are compared at once. They are rounded so that no pair is lost; the
// final test is in double.
namespace amontons {
namespace {

constexpr float inf = std::numeric_limits<float>::infinity();

// The longest side, which determines how many others a box can overlap.
double extent(const Aabb& box) {
  const Vec3 d = box.upper - box.lower;
  return std::max({d.x, d.y, d.z});
}

// Halved before the sum, so that it cannot overflow.
Vec3 centre(const Aabb& box) { return 0.5 * box.lower + 0.5 * box.upper; }

// A class holds sizes within a factor of four; class 0 holds boxes without extent. Four is coarse enough that
// a pile of grains of mixed sizes stays in one or two trees. It is fine enough that no node is enlarged by a
// box much larger than its neighbours. The exponents of doubles, from -1074 of the smallest denormal to 1023,
// shifted to be positive, give a class for every size.
constexpr std::size_t classes = 1 + 2200 / 2;
std::size_t size_class(double size) {
  return size > 0 ? 1 + static_cast<std::size_t>(std::ilogb(size) + 1075) / 2 : 0;
}

// Subtraction and conversion to float round monotonically: a <= b implies narrow(a) <= narrow(b). Overlapping
// boxes therefore still overlap when narrowed; other pairs are rejected in double. Any origin is valid; one
// among the boxes keeps the rounding small. Infinity is reserved for empty places in nodes.
float narrow(double x, double origin) {
  constexpr double largest = std::numeric_limits<float>::max();
  return static_cast<float>(std::clamp(x - origin, -largest, largest));
}

// Bit k: child k of the node overlaps the box {lower, upper}. Boxes overlap if on every axis each begins
// before the other ends; four children fill a vector, axis by axis.
unsigned overlap_mask(const auto& node, const float* box) {
  unsigned mask = 0;
#if defined(__SSE2__)
  for (int half = 0; half < 8; half += 4) {
    const auto meets = [&](int axis) {
      return _mm_and_ps(_mm_cmple_ps(_mm_load_ps(node.bound[axis] + half), _mm_set1_ps(box[axis + 3])),
                        _mm_cmpge_ps(_mm_load_ps(node.bound[axis + 3] + half), _mm_set1_ps(box[axis])));
    };
    const __m128 all = _mm_and_ps(meets(0), _mm_and_ps(meets(1), meets(2)));
    mask |= static_cast<unsigned>(_mm_movemask_ps(all)) << half;
  }
#else
  for (unsigned k = 0; k < 8; ++k) {
    bool in = true;
    for (int axis = 0; axis < 3; ++axis)
      in = in & (node.bound[axis][k] <= box[axis + 3]) & (node.bound[axis + 3][k] >= box[axis]);
    mask |= unsigned{in} << k;
  }
#endif
  return mask;
}

// The box of one child, and the box around all of them: lower, then upper corner.
void copy_child(const auto& node, std::size_t child, float* box) {
  for (int row = 0; row < 6; ++row) box[row] = node.bound[row][child];
}
void enclose(const auto& node, float* box) {
  for (int axis = 0; axis < 3; ++axis) {
    box[axis] = *std::min_element(node.bound[axis], node.bound[axis] + 8);
    box[axis + 3] = *std::max_element(node.bound[axis + 3], node.bound[axis + 3] + 8);
  }
}

// Empty places begin at infinity and end at minus infinity, so they overlap nothing.
void clear(auto& node) {
  for (int row = 0; row < 6; ++row) std::fill_n(node.bound[row], 8, row < 3 ? inf : -inf);
}

}  // namespace

std::uint64_t next_number() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

void BroadPhase::find_pairs(const Bounds& bounds, std::vector<IndexPair>& pairs, const PairSearch* outside,
                            unsigned threads) {
  bounds_ = bounds;
  const std::span<const Aabb> boxes = bounds.boxes;
  set_aside_infinite(boxes);
  if (outside && (finite_.empty() || finite_.size() < outside->least)) outside = nullptr;
  // An earlier order is valid for any boxes; it only gets slower as they move, and between steps of a
  // simulation nothing moves far. It is replaced once a search costs half as much again as the first one in
  // it.
  bool done = false;
  if (built_for_ == boxes.size() && infinite_ == last_infinite_ && built_outside_ == (outside != nullptr))
    done = search(outside, built_visits_ + built_visits_ / 2, threads);
  if (!done) {
    built_for_ = 0;  // none until the search has ended
    build(boxes);
    search(outside, std::numeric_limits<std::size_t>::max(), threads);
    built_for_ = boxes.size();
    built_outside_ = outside != nullptr;
    last_infinite_ = infinite_;
    built_visits_ = found_.visits;
  }
  add_pairs_of_infinite(boxes);
  sort(boxes.size(), pairs);
}

// Boxes with a bound that is not finite, or whose extent overflows, have no centre: they stay outside the
// tree.
void BroadPhase::set_aside_infinite(std::span<const Aabb> boxes) {
  infinite_.clear();
  finite_.clear();
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Aabb& box = boxes[i];
    const bool finite = is_finite(box.lower) && is_finite(box.upper) && std::isfinite(extent(box));
    (finite ? finite_ : infinite_).push_back(static_cast<std::int32_t>(i));
  }
}

// Finds an order of the leaves for the finite boxes.
void BroadPhase::build(std::span<const Aabb> boxes) {
  choose_origin(boxes);
  sort_by_size(boxes);
  for (std::size_t k = 0; k < start_.size(); k += 2) split(start_[k], start_[k + 1]);
  order_.resize(items_.size());
  for (std::size_t k = 0; k < items_.size(); ++k) order_[k] = items_[k].box;
  number_ = next_number();
}

// The median of a few centres is amid most boxes, even if a few others are far away.
void BroadPhase::choose_origin(std::span<const Aabb> boxes) {
  // Size (boxes): largest number of centres in the sample.
  constexpr std::size_t sample = 31;
  const std::size_t stride = finite_.size() / sample + 1;
  for (int axis = 0; axis < 3; ++axis) {
    double at[sample];
    int n = 0;
    for (std::size_t i = 0; i < finite_.size(); i += stride) at[n++] = centre(boxes[finite_[i]])[axis];
    std::nth_element(at, at + n / 2, at + n);
    origin_[axis] = n ? at[n / 2] : 0;
  }
}

// A class much smaller than its neighbours shares no node with them; the tree above then has a few subtrees
// side by side. Counting sort by class, in linear time; each class starts a new group of leaves. Afterwards
// start_ holds the begin and end of each nonempty class.
void BroadPhase::sort_by_size(std::span<const Aabb> boxes) {
  count_.assign(classes + 1, 0);
  for (std::int32_t i : finite_) ++count_[size_class(extent(boxes[i])) + 1];
  std::size_t leaves = 0;
  start_.clear();
  for (std::size_t c = 0; c < classes; ++c) {
    const std::size_t size = count_[c + 1];
    count_[c] = leaves;
    if (size) start_.insert(start_.end(), {leaves, leaves + size});
    leaves += (size + width - 1) / width * width;
  }
  items_.assign(leaves, {{}, {}, -1});
  for (std::int32_t i : finite_) {
    const Aabb& box = boxes[i];
    Item& item = items_[count_[size_class(extent(box))]++];
    const Vec3 c = centre(box), e = box.upper - box.lower;
    for (int axis = 0; axis < 3; ++axis) {
      item.centre[axis] = narrow(c[axis], origin_[axis]);
      item.extent[axis] = static_cast<float>(e[axis]);
    }
    item.box = i;
  }
}

// Constructs a k-d tree (Bentley, 1975) by medians, so that its depth depends only on the number of leaves
// and no pointer is needed. Splits the range near its middle, at a multiple of the largest possible power of
// eight: the halves then fill whole nodes of their level.
void BroadPhase::split(std::size_t first, std::size_t last) {
  if (last - first <= width) return;
  std::size_t block = width;
  while ((first / (block * width) + 1) * block * width < last) block *= width;
  std::size_t middle = ((first + last) / 2 + block / 2) / block * block;
  if (middle >= last) middle -= block;
  if (middle <= first) middle += block;

  const int axis = best_axis(first, last);
  const auto at = [&](std::size_t k) { return items_.begin() + static_cast<std::ptrdiff_t>(k); };
  std::nth_element(at(first), at(middle), at(last),
                   [&](const Item& a, const Item& b) { return a.centre[axis] < b.centre[axis]; });
  split(first, middle);
  split(middle, last);
}

// With centres spread over s and boxes of mean length e, the halves are about s / 2 + e long. The best axis
// is the one on which this is the smallest fraction of s + e, that is where s / (s + e) is largest.
int BroadPhase::best_axis(std::size_t first, std::size_t last) const {
  float lower[3] = {inf, inf, inf}, upper[3] = {-inf, -inf, -inf}, sum[3] = {0, 0, 0};
  for (std::size_t k = first; k < last; ++k)
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], items_[k].centre[axis]);
      upper[axis] = std::max(upper[axis], items_[k].centre[axis]);
      sum[axis] += items_[k].extent[axis];
    }
  int best = 0;
  float best_gain = -1, best_spread = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const float spread = upper[axis] - lower[axis], length = sum[axis] / static_cast<float>(last - first);
    const float gain = spread > 0 ? spread / (spread + length) : 0;
    if (gain > best_gain || (gain == best_gain && spread > best_spread)) {
      best = axis;
      best_gain = gain;
      best_spread = spread;
    }
  }
  return best;
}

// Writes the boxes to the tree, in the present order, level by level from the leaves up: the box of a node
// contains those of its children. If the last order is still efficient, a call does only this before the
// search. It is linear, and reads memory in order.
void BroadPhase::fit(std::span<const Aabb> boxes) {
  boxes_.resize(order_.size());
  std::size_t nodes = std::max<std::size_t>(order_.size() / width, 1), depth = 0;
  for (std::size_t children = order_.size();; children = nodes, nodes = (nodes + width - 1) / width) {
    if (levels_.size() <= depth) levels_.emplace_back();
    levels_[depth].resize(nodes);
    clear(levels_[depth].back());
    for (std::size_t k = 0; k < children; ++k) {
      float box[6] = {inf, inf, inf, -inf, -inf, -inf};
      bool moves = false;
      if (depth > 0) {
        enclose(levels_[depth - 1][k], box);
        moves = levels_[depth - 1][k].moves != 0;
      } else if (order_[k] >= 0) {
        moves = !bounds_.fixed[order_[k]];
        const Aabb& b = boxes_[k] = boxes[order_[k]];
        for (int axis = 0; axis < 3; ++axis) {
          box[axis] = narrow(b.lower[axis], origin_[axis]);
          box[axis + 3] = narrow(b.upper[axis], origin_[axis]);
        }
      }
      Node& node = levels_[depth][k / width];
      if (k % width == 0) node.moves = 0;
      node.moves |= unsigned{moves} << (k % width);
      for (int row = 0; row < 6; ++row) node.bound[row][k % width] = box[row];
    }
    ++depth;
    if (nodes == 1) break;
  }
  levels_.resize(depth);
}

// Finds every pair of overlapping finite boxes. Returns false after more visits than the limit: there are
// better orders than this one.
bool BroadPhase::search(const PairSearch* outside, std::size_t limit, unsigned threads) {
  found_.pairs.clear();
  found_.visits = 0;
  if (outside) {
    found_.visits = outside->find({bounds_, order_, origin_, number_}, found_.pairs);
    return found_.visits <= limit;
  }
  fit(bounds_.boxes);
  return search_groups(limit, threads);
}

// Finds the pairs in the tree. The search runs by groups and not by pairs of nodes: the
// box of eight leaves is tight, and the descent for one group stays in the cache. Groups are independent of
// each other, so that threads take parts of them.
bool BroadPhase::search_groups(std::size_t limit, unsigned threads) {
  constexpr std::size_t size = 128;  // not tuned: groups, 100 us, long beside the hand-over to a thread
  const std::size_t groups = order_.size() / width;
  parts_.resize(std::max(parts_.size(), groups / size + 1));
  std::swap(parts_[0], found_);  // one thread copies nothing
  const std::size_t parts =
      for_parts(threads, groups, size, [&](std::size_t k, std::size_t g, std::size_t last) {
        Found& found = parts_[k];
        found.pairs.clear();
        found.visits = 0;
        for (; g < last && found.visits <= limit; ++g) {
          // The pairs within the group: each leaf with those after it.
          for (int i = 0; i + 1 < width; ++i) cross_leaf(g, i, g, ~1u << i, found);
          cross_later_groups(g, found);
        }
      });
  std::swap(parts_[0], found_);
  for (std::size_t k = 1; k < parts; ++k) {
    found_.pairs.insert(found_.pairs.end(), parts_[k].pairs.begin(), parts_[k].pairs.end());
    found_.visits += parts_[k].visits;
  }
  return found_.visits <= limit;
}

// Descends from the root into all nodes that overlap the box of group g and contain later groups: each pair
// of groups is found once, from the earlier one. A group of fixed boxes meets only those that move.
void BroadPhase::cross_later_groups(std::size_t g, Found& found) const {
  const std::size_t top = levels_.size() - 1;
  if (top == 0) return;
  float box[6];
  enclose(levels_[0][g], box);
  const bool moves = levels_[0][g].moves != 0;
  // A node on the stack is { level, index }; each level leaves at most seven behind.
  struct {
    std::size_t level, index;
  } stack[8 * 24];
  int size = 0;
  stack[size++] = {top, 0};
  while (size > 0) {
    const auto [level, index] = stack[--size];
    ++found.visits;
    const unsigned shift = 3 * static_cast<unsigned>(level - 1);
    const Node& node = levels_[level][index];
    for (unsigned mask = overlap_mask(node, box) & (moves ? ~0u : node.moves); mask; mask &= mask - 1) {
      const std::size_t child = index * width + static_cast<std::size_t>(std::countr_zero(mask));
      if (((child + 1) << shift) - 1 <= g) continue;  // all its groups are g or earlier
      if (level > 1)
        stack[size++] = {level - 1, child};
      else
        cross(g, child, found);
    }
  }
}

// All pairs between the leaves of group g and those of a later group h. First finds the leaves of g that
// overlap the box of h, which its parent stores, then compares each with the leaves of h.
void BroadPhase::cross(std::size_t g, std::size_t h, Found& found) const {
  ++found.visits;
  float box[6];
  copy_child(levels_[1][h / width], h % width, box);
  for (unsigned mask = overlap_mask(levels_[0][g], box); mask; mask &= mask - 1)
    cross_leaf(g, std::countr_zero(mask), h, ~0u, found);
}

// The pairs of leaf i of group g with those leaves of group h whose bit is set.
void BroadPhase::cross_leaf(std::size_t g, int i, std::size_t h, unsigned which, Found& found) const {
  float box[6];
  copy_child(levels_[0][g], static_cast<std::size_t>(i), box);
  if (!(levels_[0][g].moves >> i & 1)) which &= levels_[0][h].moves;
  for (unsigned mask = which & overlap_mask(levels_[0][h], box); mask; mask &= mask - 1) {
    const std::size_t leaf_a = g * width + static_cast<std::size_t>(i);
    const std::size_t leaf_b = h * width + static_cast<std::size_t>(std::countr_zero(mask));
    add(order_[leaf_a], order_[leaf_b], boxes_[leaf_a], boxes_[leaf_b], found);
  }
}

// Infinite boxes are few (planes): each against all the others, two of them from the first one only.
void BroadPhase::add_pairs_of_infinite(std::span<const Aabb> boxes) {
  for (auto a = infinite_.begin(); a != infinite_.end(); ++a) {
    for (std::int32_t b : finite_) add(*a, b, boxes[*a], boxes[b], found_);
    for (auto b = a + 1; b != infinite_.end(); ++b) add(*a, *b, boxes[*a], boxes[*b], found_);
  }
}

// Tests in double, with the given boxes, the pairs that the floats accept: rounding to float only affects the
// time.
void BroadPhase::add(std::int32_t a, std::int32_t b, const Aabb& box_a, const Aabb& box_b,
                     Found& found) const {
  if ((bounds_.fixed[a] && bounds_.fixed[b]) || !is_overlap(box_a, box_b) ||
      !may_touch(bounds_.balls[a], bounds_.travels[a], bounds_.balls[b], bounds_.travels[b]))
    return;
  found.pairs.emplace_back(std::min(a, b), std::max(a, b));
}

// A radix sort with two digits: counting sorts by the second and then by the first box; the later one keeps
// the order of the earlier one among equal keys. Linear for any number of partners of a box.
void BroadPhase::sort(std::size_t boxes, std::vector<IndexPair>& pairs) {
  std::vector<IndexPair>& found = found_.pairs;
  pairs.resize(found.size());
  const auto pass = [&](auto key, const std::vector<IndexPair>& from, std::vector<IndexPair>& to) {
    start_.assign(boxes + 1, 0);
    for (const IndexPair& pair : from) ++start_[key(pair) + 1];
    for (std::size_t i = 0; i < boxes; ++i) start_[i + 1] += start_[i];
    for (const IndexPair& pair : from) to[start_[key(pair)]++] = pair;
  };
  pass([](const IndexPair& pair) { return pair.second; }, found, pairs);
  pass([](const IndexPair& pair) { return pair.first; }, pairs, found);
  pairs.swap(found);
}

}  // namespace amontons
