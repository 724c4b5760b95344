// docs/algorithm.md (30). Symbolic part: greedy minimum degree on the graph of nodes, relabelled in
// postorder. Numeric part: right-looking, block by block.
//
// The pivot of node k with sign s: s K_kk = Q Q'. Its blocks K_kq, q above, become U_q = Q^-1 K_kq, the
// transposed blocks of L. All pairs q <= r above are updated, K_qr -= s U_q' U_r.
#include "solvers/linear/quasidefinite.hpp"

#include <algorithm>
#include <cmath>
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
using Node = QuasidefiniteFactor::Node;

// The greedy order: among the nodes that may be next, one with the fewest neighbours. Joints come first among
// equals, so that a joint follows its body at once. `above` receives the neighbours of each node at its
// elimination.
std::vector<Index> minimum_degree(std::span<const Node> nodes, const Neighbours& edges, Neighbours& above) {
  const std::size_t count = nodes.size();
  Neighbours neighbours = edges;
  // Nodes that must come before a joint: one body, or all if it has coordinates.
  std::vector<std::size_t> awaited(count, 0);
  std::set<std::tuple<std::size_t, Node, Index>> queue;
  const auto key = [&](Index i) { return std::tuple(neighbours[i].size(), nodes[i], i); };
  for (std::size_t i = 0; i < count; ++i) {
    if (nodes[i] == Node::joint) {
      const auto is_body = [&](Index k) { return nodes[k] == Node::body; };
      const std::size_t own = edges[i].size();
      awaited[i] =
          std::all_of(edges[i].begin(), edges[i].end(), is_body) ? std::min<std::size_t>(own, 1) : own;
    }
    if (awaited[i] == 0) queue.insert(key(static_cast<Index>(i)));
  }
  std::vector<Index> order, merged;
  above.assign(count, {});
  while (!queue.empty()) {
    const Index k = std::get<2>(*queue.begin());
    queue.erase(queue.begin());
    order.push_back(k);
    // Its neighbours become neighbours of each other.
    for (Index i : neighbours[k]) {
      if (awaited[i] == 0) queue.erase(key(i));
      merged.clear();
      std::set_union(neighbours[i].begin(), neighbours[i].end(), neighbours[k].begin(), neighbours[k].end(),
                     std::back_inserter(merged));
      std::erase_if(merged, [&](Index j) { return j == i || j == k; });
      neighbours[i] = merged;
      if (awaited[i] > 0 && std::binary_search(edges[i].begin(), edges[i].end(), k)) --awaited[i];
      if (awaited[i] == 0) queue.insert(key(i));
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

void QuasidefiniteFactor::analyse(std::span<const Node> nodes, std::span<const Edge> edges) {
  order(nodes, edges);
  place_edges(edges);
  plan_updates();
  diagonal_.assign(area * sign_.size(), 0.0);
  least_.assign(n * sign_.size(), 0.0);
  blocks_.assign(area * above_.size(), 0.0);
}

void QuasidefiniteFactor::order(std::span<const Node> nodes, std::span<const Edge> edges) {
  const std::size_t count = nodes.size();
  Neighbours neighbours(count), above;
  for (const Edge& e : edges) {
    neighbours[e.a].push_back(e.b);
    neighbours[e.b].push_back(e.a);
  }
  for (auto& list : neighbours) std::sort(list.begin(), list.end());
  const std::vector<Index> greedy = minimum_degree(nodes, neighbours, above);
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
    sign_[position_[i]] = nodes[i] == Node::joint ? -1 : 1;
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
  unit_.assign(nodes(), 0);
  for (std::size_t k = 0; k < nodes(); ++k) unit_[k] = sign_[k] > 0;
  for (std::size_t k = 0; k < nodes(); ++k) {
    const double d = static_cast<double>(last_slot(k) - first_slot(k));
    work_ += area * n * (!unit_[k] + d + 0.5 * d * (d + 1));
    for (std::size_t a = first_slot(k); a < last_slot(k); ++a) {
      const Index q = above_[a];
      target_.push_back(-1 - q);
      unit_[q] = 0;
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
  for (std::size_t k = 0; k < nodes(); ++k)
    for (int i = 0; i < n; ++i) diagonal_[area * k + (n + 1) * i] = sign_[k];
  std::fill(blocks_.begin(), blocks_.end(), 0.0);
}

bool QuasidefiniteFactor::factor() {
  const std::ptrdiff_t* target = target_.data();
  for (std::size_t k = 0; k < nodes(); ++k) {
    double* pivot = &diagonal_[area * k];
    if (!unit_[k] && !AMONTONS_DISPATCH(factor_six, pivot, sign_[k], &least_[n * k])) return false;
    const std::size_t first = first_slot(k), count = last_slot(k) - first;
    if (count == 0) continue;
    AMONTONS_DISPATCH(eliminate_six, unit_[k] ? nullptr : pivot, &blocks_[area * first], count, sign_[k],
                      PairTargets{target, diagonal_.data(), blocks_.data()});
    target += count * (count + 1) / 2;
  }
  return true;
}

void QuasidefiniteFactor::forward(double* r) const {
  for (std::size_t k = 0; k < nodes(); ++k) {
    const double* R = &diagonal_[area * k];
    double* w = r + n * k;
    if (!unit_[k])
      for (int i = 0; i < n; ++i) {
        w[i] *= R[(n + 1) * i];
        for (int j = 0; j < i; ++j) w[i] += R[n * i + j] * w[j];
      }
    for (std::size_t a = first_slot(k); a < last_slot(k); ++a) {
      const double* U = &blocks_[area * a];
      Two change[3] = {};
      for (int j = 0; j < n; ++j) add_six(sign_[k] * w[j], U + n * j, change);
      Two* to = reinterpret_cast<Two*>(r + n * above_[a]);
      for (int i = 0; i < 3; ++i) to[i] -= change[i];
    }
  }
}

// z_k = Q^-T s (w_k - sum_q U_q z_q)
void QuasidefiniteFactor::backward(double* w) const {
  for (std::size_t k = nodes(); k-- > 0;) {
    double rest[n];
    std::copy_n(w + n * k, n, rest);
    for (int i = 0; i < n; ++i) rest[i] *= sign_[k];
    for (std::size_t a = first_slot(k); a < last_slot(k); ++a) {
      const double *U = &blocks_[area * a], *z = w + n * above_[a];
      for (int i = 0; i < n; ++i) rest[i] -= sign_[k] * dot_six(U + n * i, z);
    }
    const double* R = &diagonal_[area * k];
    if (!unit_[k])
      for (int i = n; i-- > 0;) {
        for (int j = 0; j < i; ++j) rest[j] += R[n * i + j] * rest[i];
        rest[i] *= R[(n + 1) * i];
      }
    std::copy_n(rest, n, w + n * k);
  }
}

void QuasidefiniteFactor::forward_node(std::size_t position, double* w, std::size_t columns) const {
  AMONTONS_DISPATCH(divide_six_rows, &diagonal_[area * position], w, columns);
}

void QuasidefiniteFactor::forward_update(std::size_t slot, int sign, const double* w, std::size_t columns,
                                         double* r, std::size_t stride) const {
  AMONTONS_DISPATCH(subtract_six_rows, r, stride, &blocks_[area * slot], sign, w, columns);
}

}  // namespace amontons
