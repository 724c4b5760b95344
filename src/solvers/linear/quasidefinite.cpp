// docs/algorithm.md (30). Symbolic part: greedy minimum degree on the graph of nodes, relabelled in
// postorder. Numeric part: right-looking, block by block.
//
// The pivot of node k with sign s: s K_kk = R R'. Its blocks K_kq, q above, become U_q = R^-1 K_kq, the
// transposed blocks of L. All pairs q <= r above are updated, K_qr -= s U_q' U_r. The inverse of R is stored
// in place of R: a solve multiplies by it, without a chain of divisions.
#include "solvers/linear/quasidefinite.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>
#include <tuple>

#include "solvers/linear/row_kernel.hpp"

namespace amontons {

namespace {

constexpr int n = QuasidefiniteFactor::width;
constexpr int area = QuasidefiniteFactor::area;

// Two numbers in one register of any processor; a row of six is three of these.
using Two __attribute__((vector_size(16), aligned(8), may_alias)) = double;

// <row, v> for six numbers.
inline double dot_six(const double* row, const double* v) {
  const Two* a = reinterpret_cast<const Two*>(row);
  const Two* b = reinterpret_cast<const Two*>(v);
  const Two sum = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  return sum[0] + sum[1];
}

// sum += f row for six numbers.
inline void add_six(double f, const double* row, Two (&sum)[3]) {
  const Two* a = reinterpret_cast<const Two*>(row);
  for (int k = 0; k < 3; ++k) sum[k] += f * a[k];
}

using Neighbours = std::vector<std::vector<Index>>;

// The greedy order: among the nodes that may be next, one with the fewest neighbours. Negative nodes come
// first among equals, so that a joint follows its body at once. `above` receives the neighbours of each node
// at its elimination.
std::vector<Index> minimum_degree(std::span<const signed char> sign, Neighbours neighbours,
                                  Neighbours& above) {
  const std::size_t count = sign.size();
  // A negative node may come after one of its neighbours; one without neighbours at once.
  std::vector<unsigned char> ready(count);
  std::set<std::tuple<std::size_t, int, Index>> queue;
  const auto key = [&](Index i) { return std::tuple(neighbours[i].size(), int{sign[i]}, i); };
  for (std::size_t i = 0; i < count; ++i) {
    ready[i] = sign[i] > 0 || neighbours[i].empty();
    if (ready[i]) queue.insert(key(static_cast<Index>(i)));
  }
  std::vector<Index> order, merged;
  above.assign(count, {});
  while (!queue.empty()) {
    const Index k = std::get<2>(*queue.begin());
    queue.erase(queue.begin());
    order.push_back(k);
    // Its neighbours become neighbours of each other.
    for (Index i : neighbours[k]) {
      if (ready[i]) queue.erase(key(i));
      merged.clear();
      std::set_union(neighbours[i].begin(), neighbours[i].end(), neighbours[k].begin(), neighbours[k].end(),
                     std::back_inserter(merged));
      std::erase_if(merged, [&](Index j) { return j == i || j == k; });
      neighbours[i] = merged;
      ready[i] = 1;
      queue.insert(key(i));
    }
    above[k] = std::move(neighbours[k]);
  }
  return order;
}

// The postorder of a forest whose parents come after their children: place[i] for each i; children keep their
// order.
std::vector<Index> forest_postorder(const std::vector<Index>& parent) {
  const std::size_t count = parent.size();
  // Sizes of the subtrees, then each node's first free place; parents before children.
  std::vector<Index> size(count, 1), first(count), place(count);
  for (std::size_t i = 0; i < count; ++i)
    if (parent[i] >= 0) size[parent[i]] += size[i];
  Index roots = 0;
  for (std::size_t i = count; i-- > 0;) {
    Index& end = parent[i] >= 0 ? first[parent[i]] : roots;
    first[i] = end;
    end += size[i];
    place[i] = first[i] + size[i] - 1;
  }
  return place;
}

}  // namespace

void QuasidefiniteFactor::analyse(std::span<const signed char> sign, std::span<const Edge> edges) {
  order(sign, edges);
  place_edges(edges);
  plan_updates();
  diagonal_.assign(area * nodes(), 0.0);
  blocks_.assign(area * above_.size(), 0.0);
}

void QuasidefiniteFactor::order(std::span<const signed char> sign, std::span<const Edge> edges) {
  const std::size_t count = sign.size();
  Neighbours neighbours(count), above;
  for (const Edge& e : edges) {
    neighbours[e.a].push_back(e.b);
    neighbours[e.b].push_back(e.a);
  }
  for (auto& list : neighbours) std::sort(list.begin(), list.end());
  const std::vector<Index> greedy = minimum_degree(sign, std::move(neighbours), above);
  std::vector<Index> turn(count), parent(count, -1);
  for (std::size_t k = 0; k < count; ++k) turn[greedy[k]] = static_cast<Index>(k);
  // The parent in the elimination tree is the first node above; the others are also above the parent.
  for (std::size_t k = 0; k < count; ++k)
    for (Index i : above[greedy[k]])
      if (parent[k] < 0 || turn[i] < parent[k]) parent[k] = turn[i];
  const std::vector<Index> place = forest_postorder(parent);
  position_.resize(count);
  sign_.resize(count);
  parent_.assign(count, -1);
  std::vector<Index> node(count);
  for (std::size_t i = 0; i < count; ++i) {
    position_[i] = place[turn[i]];
    sign_[position_[i]] = sign[i];
    node[position_[i]] = static_cast<Index>(i);
    if (const Index p = parent[turn[i]]; p >= 0) parent_[position_[i]] = place[p];
  }
  first_slot_.assign(1, 0);
  above_.clear();
  for (std::size_t p = 0; p < count; ++p) {
    for (Index i : above[node[p]]) above_.push_back(position_[i]);
    std::sort(above_.begin() + static_cast<std::ptrdiff_t>(first_slot_[p]), above_.end());
    first_slot_.push_back(above_.size());
  }
}

void QuasidefiniteFactor::place_edges(std::span<const Edge> edges) {
  edge_block_.clear();
  edge_a_first_.clear();
  for (const Edge& e : edges) {
    const Index a = position_[e.a], b = position_[e.b], low = std::min(a, b);
    const auto begin = above_.begin() + static_cast<std::ptrdiff_t>(first_slot(low));
    const auto end = above_.begin() + static_cast<std::ptrdiff_t>(last_slot(low));
    edge_block_.push_back(
        static_cast<std::size_t>(std::lower_bound(begin, end, std::max(a, b)) - above_.begin()));
    edge_a_first_.push_back(a < b);
  }
}

// Pairs of each node's slots, in the order of factor(): the block (q, r) of K is among the slots of q.
void QuasidefiniteFactor::plan_updates() {
  target_.clear();
  work_ = 0;
  for (std::size_t k = 0; k < nodes(); ++k) {
    const double d = static_cast<double>(last_slot(k) - first_slot(k));
    work_ += area * n * (1 + d + 0.5 * d * (d + 1));
    for (std::size_t a = first_slot(k); a < last_slot(k); ++a) {
      const Index q = above_[a];
      target_.push_back(-1 - q);
      std::size_t slot = first_slot(q);
      for (std::size_t c = a + 1; c < last_slot(k); ++c) {
        while (above_[slot] != above_[c]) ++slot;
        target_.push_back(static_cast<std::ptrdiff_t>(slot));
      }
    }
  }
}

void QuasidefiniteFactor::clear() {
  std::fill(diagonal_.begin(), diagonal_.end(), 0.0);
  std::fill(blocks_.begin(), blocks_.end(), 0.0);
}

bool QuasidefiniteFactor::factor() {
  const std::ptrdiff_t* target = target_.data();
  for (std::size_t k = 0; k < nodes(); ++k) {
    double* pivot = &diagonal_[area * k];
    if (!AMONTONS_DISPATCH(invert_root_six, pivot, sign_[k])) return false;
    const std::size_t first = first_slot(k), count = last_slot(k) - first;
    if (count == 0) continue;
    AMONTONS_DISPATCH(eliminate_six, pivot, &blocks_[area * first], count, sign_[k],
                      PairTargets{target, diagonal_.data(), blocks_.data()});
    target += count * (count + 1) / 2;
  }
  return true;
}

void QuasidefiniteFactor::forward(double* r) const {
  for (std::size_t k = 0; k < nodes(); ++k) {
    const double* X = &diagonal_[area * k];  // its upper triangle is zero
    double* own = r + n * k;
    double w[n];
    for (int i = 0; i < n; ++i) w[i] = dot_six(X + n * i, own);
    std::copy_n(w, n, own);
    for (std::size_t a = first_slot(k); a < last_slot(k); ++a) {
      const double* U = &blocks_[area * a];
      Two change[3] = {};
      for (int j = 0; j < n; ++j) add_six(sign_[k] * w[j], U + n * j, change);
      Two* to = reinterpret_cast<Two*>(r + n * above_[a]);
      for (int i = 0; i < 3; ++i) to[i] -= change[i];
    }
  }
}

// z_k = R^-T s (w_k - sum_q U_q z_q)
void QuasidefiniteFactor::backward(double* w) const {
  for (std::size_t k = nodes(); k-- > 0;) {
    double rest[n];
    std::copy_n(w + n * k, n, rest);
    for (int i = 0; i < n; ++i) rest[i] *= sign_[k];
    for (std::size_t a = first_slot(k); a < last_slot(k); ++a) {
      const double *U = &blocks_[area * a], *z = w + n * above_[a];
      for (int i = 0; i < n; ++i) rest[i] -= sign_[k] * dot_six(U + n * i, z);
    }
    Two z[3] = {};
    for (int i = 0; i < n; ++i) add_six(rest[i], &diagonal_[area * k + n * i], z);
    std::memcpy(w + n * k, z, sizeof z);
  }
}

void QuasidefiniteFactor::forward_node(std::size_t position, double* w, std::size_t columns) const {
  AMONTONS_DISPATCH(multiply_six_rows, &diagonal_[area * position], w, columns);
}

void QuasidefiniteFactor::forward_update(std::size_t slot, int sign, const double* w, std::size_t columns,
                                         double* r, std::size_t stride) const {
  AMONTONS_DISPATCH(subtract_six_rows, r, stride, &blocks_[area * slot], sign, w, columns);
}

}  // namespace amontons
