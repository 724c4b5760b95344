// Two orders. Minimum degree is greedy: it is hard to beat on walls, chains and small piles. It loses to
// nested dissection on large heaps, whose graphs are three-dimensional (George 1973; Lipton, Rose, Tarjan
// 1979: n^(4/3) entries and n^2 multiplications).
//
// Dissection finds a set of blocks that separates the rest into two halves. The halves are eliminated first,
// each in the same way, and the separator last. Here a half is one side of a plane. Among all planes along
// seven directions with two fifths or more on either side, the one with the smallest border is taken. The
// separator is the smallest set of blocks that touches every edge across it; by theorems of Koenig it follows
// from a largest matching of these edges.
#include "solvers/linear/block_order.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "amontons/base/leave.hpp"

namespace amontons {

namespace {

// Time of minimum degree per entry of the pattern (s); a high estimate, because it cannot be interrupted.
constexpr double ordering_cost = 1e-7;
// Multiplications per block, in blocks, above which dissection is tried. For a wall they are the square of
// its height in blocks, at any length. For a heap they grow as the number of its blocks, as L has n^(2/3)
// rows in its last columns, and soon pay for two orders.
constexpr double much_work = 600;
// Parts of at most this many blocks are ordered by minimum degree: little is left to gain.
constexpr std::size_t small_part = 100;
// A block with more neighbours than this belongs to no side.
constexpr std::size_t hub_degree = 64;

std::vector<int> minimum_degree(const BlockGraph& graph) {
  const int n = static_cast<int>(graph.size());
  std::vector<Eigen::Triplet<char>> entries;
  for (int i = 0; i < n; ++i) {
    if (i % 64 == 63) leave_if_due();
    entries.emplace_back(i, i, 1);
    for (int j : graph[i]) entries.emplace_back(i, j, 1);
  }
  // Eigen's AMD wants the pattern of a matrix with its diagonal.
  Eigen::SparseMatrix<char> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  leave_if_due(ordering_cost * static_cast<double>(pattern.nonZeros()));
  Eigen::AMDOrdering<int>()(pattern, permutation);
  return {permutation.indices().data(), permutation.indices().data() + n};
}

// Multiplications of the factorisation in an order, in blocks: the squares of the lengths of L's columns. Row
// k of L consists of the paths from k's neighbours up to k in the elimination tree (Liu 1990).
double factor_work(const std::vector<int>& order, const BlockGraph& graph) {
  const int n = static_cast<int>(order.size());
  const std::vector<int> parent = elimination_tree(order, graph);
  std::vector<int> position(n), mark(n, -1);
  std::vector<double> length(n, 1);
  for (int k = 0; k < n; ++k) position[order[k]] = k;
  for (int k = 0; k < n; ++k) {
    if (k % 64 == 63) leave_if_due();
    mark[k] = k;
    for (int neighbour : graph[order[k]])
      for (int i = position[neighbour]; i < k && mark[i] != k; i = parent[i]) {
        mark[i] = k;
        ++length[i];
      }
  }
  return std::inner_product(length.begin(), length.end(), length.begin(), 0.0);
}

class Dissection {
 public:
  Dissection(const BlockGraph& graph, std::span<const Vec3> positions)
      : graph_(graph),
        positions_(positions),
        rank_(graph.size(), outside),
        match_(graph.size()),
        seen_(graph.size()) {}

  std::vector<int> order() {
    std::vector<int> all, hubs;
    for (int i = 0; i < static_cast<int>(graph_.size()); ++i)
      (graph_[i].size() > hub_degree ? hubs : all).push_back(i);
    divide(std::move(all));
    order_.insert(order_.end(), hubs.begin(), hubs.end());
    return std::move(order_);
  }

 private:
  static constexpr int outside = -1;

  // A plane: the part sorted along a direction, and the number of its blocks on the near side.
  struct Cut {
    std::vector<int> sorted;
    int near = 0, border = 0;
  };

  // Appends the blocks of a part to the order.
  void divide(std::vector<int> part) {
    leave_if_due();
    if (part.size() <= small_part) return append_small(part);
    const Cut cut = best_cut(part);
    if (cut.border >= static_cast<int>(part.size()) / 4) return append_small(part);  // no plane divides it
    for (int k = 0; k < static_cast<int>(part.size()); ++k) rank_[cut.sorted[k]] = k;
    const std::vector<int> separator = cover(cut);
    for (int i : separator) rank_[i] = outside;
    std::vector<int> near, far;
    for (int i : cut.sorted)
      if (rank_[i] != outside) (rank_[i] < cut.near ? near : far).push_back(i);
    for (int i : cut.sorted) rank_[i] = outside;
    divide(std::move(near));
    divide(std::move(far));
    order_.insert(order_.end(), separator.begin(), separator.end());
  }

  void append_small(const std::vector<int>& part) {
    for (int k = 0; k < static_cast<int>(part.size()); ++k) rank_[part[k]] = k;
    BlockGraph inner(part.size());
    for (std::size_t k = 0; k < part.size(); ++k)
      for (int j : graph_[part[k]])
        if (rank_[j] != outside) inner[k].push_back(rank_[j]);
    for (int i : part) rank_[i] = outside;
    for (int k : minimum_degree(inner)) order_.push_back(part[k]);
  }

  Cut best_cut(const std::vector<int>& part) {
    constexpr Vec3 directions[] = {{1, 0, 0},  {0, 1, 0},  {0, 0, 1}, {1, 1, 1},
                                   {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};
    Cut best{{}, 0, static_cast<int>(part.size())};
    for (const Vec3& direction : directions) {
      Cut cut = cut_along(part, direction);
      if (cut.border < best.border) best = std::move(cut);
    }
    return best;
  }

  // Takes the ranks of a part along a direction. A block lies on the near border of all cuts from above its
  // rank up to that of its last neighbour. It lies on the far border of cuts from above its first neighbour's
  // rank up to its own. Both counts for all cuts are sums of steps. Among the cuts in the middle fifth the
  // one with the smaller border is taken.
  Cut cut_along(const std::vector<int>& part, const Vec3& direction) {
    const int n = static_cast<int>(part.size());
    Cut cut{part, 0, n};
    std::sort(cut.sorted.begin(), cut.sorted.end(), [&](int i, int j) {
      const double a = dot(positions_[i], direction), b = dot(positions_[j], direction);
      return a != b ? a < b : i < j;
    });
    for (int k = 0; k < n; ++k) rank_[cut.sorted[k]] = k;
    std::vector<int> near(n + 2), far(n + 2);
    for (int k = 0; k < n; ++k) {
      int first = k, last = k;
      for (int j : graph_[cut.sorted[k]]) {
        if (rank_[j] == outside) continue;
        first = std::min(first, rank_[j]);
        last = std::max(last, rank_[j]);
      }
      ++near[k + 1], --near[last + 1];
      ++far[first + 1], --far[k + 1];
    }
    for (int k = 1; k <= n; ++k) near[k] += near[k - 1], far[k] += far[k - 1];
    for (int k = 2 * n / 5; k <= 3 * n / 5; ++k)
      if (const int border = std::min(near[k], far[k]); border < cut.border)
        cut.near = k, cut.border = border;
    for (int i : part) rank_[i] = outside;
    return cut;
  }

  // Calls f(j) for the neighbours of a near block beyond the cut.
  template <class F>
  void across(int i, const Cut& cut, F f) const {
    for (int j : graph_[i])
      if (rank_[j] >= cut.near) f(j);
  }

  // The smallest set that touches every edge across the cut. Marked are all blocks that an alternating path
  // from an unmatched near block reaches: over any edge to the far side, over a matched edge back. The set is
  // the unmarked near blocks and the marked far ones.
  std::vector<int> cover(const Cut& cut) {
    std::vector<int> near, reached, result;
    for (int k = 0; k < cut.near; ++k) {
      bool borders = false;
      across(cut.sorted[k], cut, [&](int) { borders = true; });
      if (borders) near.push_back(cut.sorted[k]);
    }
    for (int i : cut.sorted) match_[i] = -1;
    for (int i : cut.sorted) seen_[i] = -1;
    for (int i : near) augment(i, i, cut);
    for (int i : cut.sorted) seen_[i] = -1;
    for (int i : near)
      if (match_[i] < 0) reached.push_back(i), seen_[i] = 1;
    for (std::size_t next = 0; next < reached.size(); ++next)
      across(reached[next], cut, [&](int j) {
        if (seen_[j] > 0) return;
        seen_[j] = 1;
        if (const int back = match_[j]; back >= 0 && seen_[back] < 0)
          reached.push_back(back), seen_[back] = 1;
      });
    for (int i : near)
      if (seen_[i] < 0) result.push_back(i);
    for (int k = cut.near; k < static_cast<int>(cut.sorted.size()); ++k)
      if (seen_[cut.sorted[k]] > 0) result.push_back(cut.sorted[k]);
    return result;
  }

  // Searches an augmenting path: to an unmatched far block along edges alternately outside and inside the
  // matching; then exchanges them. The depth of the recursion is the length of the path, at most the border.
  // seen_[j] = run: already tried in this run.
  bool augment(int i, int run, const Cut& cut) {
    for (int j : graph_[i]) {
      if (rank_[j] < cut.near || seen_[j] == run) continue;
      seen_[j] = run;
      if (match_[j] >= 0 && !augment(match_[j], run, cut)) continue;
      match_[j] = i;
      match_[i] = j;
      return true;
    }
    return false;
  }

  const BlockGraph& graph_;
  std::span<const Vec3> positions_;
  std::vector<int> rank_;   // in the current part
  std::vector<int> match_;  // other end of an edge of the matching, or -1
  std::vector<int> seen_;
  std::vector<int> order_;
};

}  // namespace

// The elimination tree of the matrix whose columns are `order` (Liu 1986). For each k every neighbour i < k
// climbs from i to the root of the tree so far, which becomes a child of k. `ancestor` holds short cuts (path
// compression): all visited nodes point to k, so that the time is almost linear.
std::vector<int> elimination_tree(const std::vector<int>& order, const BlockGraph& graph) {
  const int n = static_cast<int>(order.size());
  std::vector<int> position(n), parent(n, -1), ancestor(n, -1);
  for (int k = 0; k < n; ++k) position[order[k]] = k;
  for (int k = 0; k < n; ++k)
    for (int neighbour : graph[order[k]]) {
      int i = position[neighbour];
      while (i != -1 && i < k) {
        const int next = ancestor[i];
        ancestor[i] = k;
        if (next == -1) parent[i] = k;
        i = next;
      }
    }
  return parent;
}

std::vector<int> order_blocks(const BlockGraph& graph, std::span<const Vec3> positions) {
  std::vector<int> greedy = minimum_degree(graph);
  const auto finite = [](const Vec3& p) { return std::isfinite(p.x + p.y + p.z); };
  const bool known =
      positions.size() == graph.size() && std::all_of(positions.begin(), positions.end(), finite);
  if (!known || graph.size() <= small_part) return greedy;
  const double work = factor_work(greedy, graph);
  if (work < much_work * static_cast<double>(graph.size())) return greedy;
  std::vector<int> dissected = Dissection(graph, positions).order();
  return factor_work(dissected, graph) < work ? dissected : greedy;
}

}  // namespace amontons
