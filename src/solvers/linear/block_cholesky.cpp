#include "amontons/solvers/linear/block_cholesky.hpp"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>

#include "solvers/linear/front_kernel.hpp"

namespace amontons {

namespace {

// Supernodes are merged while explicit zeros stay below this part of the panel, or the panel is small: dense
// kernels on slightly larger fronts beat many tiny ones.
constexpr double relaxed_zeros = 0.15;
constexpr int small_panel = 6;

std::vector<int> minimum_degree(int n, const std::vector<std::vector<int>>& adjacency) {
  std::vector<Eigen::Triplet<char>> entries;
  for (int i = 0; i < n; ++i) {
    entries.emplace_back(i, i, 1);
    for (int j : adjacency[i]) entries.emplace_back(i, j, 1);
  }
  Eigen::SparseMatrix<char> pattern(n, n);
  pattern.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  return {permutation.indices().data(), permutation.indices().data() + n};
}

// The elimination tree of the matrix whose columns are `sequence` (Liu 1986, with path compression).
std::vector<int> elimination_tree(const std::vector<int>& sequence,
                                  const std::vector<std::vector<int>>& adjacency) {
  const int n = static_cast<int>(sequence.size());
  std::vector<int> position(n), parent(n, -1), ancestor(n, -1);
  for (int k = 0; k < n; ++k) position[sequence[k]] = k;
  for (int k = 0; k < n; ++k)
    for (int neighbour : adjacency[sequence[k]]) {
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

std::vector<int> postorder(const std::vector<int>& parent) {
  const int n = static_cast<int>(parent.size());
  std::vector<std::vector<int>> children(n);
  std::vector<int> stack, order;
  for (int i = n - 1; i >= 0; --i) (parent[i] < 0 ? stack : children[parent[i]]).push_back(i);
  std::reverse(stack.begin(), stack.end());
  // Preorder with the children reversed, read backwards, is a postorder.
  while (!stack.empty()) {
    const int i = stack.back();
    stack.pop_back();
    order.push_back(i);
    for (int child : children[i]) stack.push_back(child);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

}  // namespace

BlockCholesky::BlockCholesky(std::span<const int> sizes, std::span<const std::pair<int, int>> edges) {
  order(sizes, edges);
  // The panels, the largest front and the largest stack of update matrices.
  std::size_t panel_entries = 0, largest_front = 0, stack = 0, largest_stack = 0;
  for (Supernode& s : supernodes_) {
    s.panel = panel_entries;
    panel_entries += static_cast<std::size_t>(s.front) * s.columns;
    largest_front = std::max<std::size_t>(largest_front, s.front);
    for (int c : s.children) {
      const std::size_t rest = supernodes_[c].front - supernodes_[c].columns;
      stack -= rest * rest;
    }
    const std::size_t rest = s.front - s.columns;
    stack += rest * rest;
    largest_stack = std::max(largest_stack, stack);
  }
  panels_.resize(panel_entries + 2);  // kernels add zeros to up to two entries past a block
  front_.resize(largest_front * (largest_front + 8));
  stack_.resize(largest_stack);
  work_.resize(
      std::max<std::size_t>(front_pack_size(static_cast<int>(largest_front)), rows_ + largest_front));
}

void BlockCholesky::order(std::span<const int> sizes, std::span<const std::pair<int, int>> edges) {
  const int n = static_cast<int>(sizes.size());
  std::vector<std::vector<int>> adjacency(n);
  for (auto [i, j] : edges) {
    if (i == j) continue;
    adjacency[i].push_back(j);
    adjacency[j].push_back(i);
  }
  for (auto& neighbours : adjacency) {
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
  }
  // Relabel in postorder: then a supernode is a range of nodes and children precede parents on a stack.
  const std::vector<int> degree_order = minimum_degree(n, adjacency);
  const std::vector<int> post = postorder(elimination_tree(degree_order, adjacency));
  std::vector<int> sequence(n);
  for (int k = 0; k < n; ++k) sequence[k] = degree_order[post[k]];
  const std::vector<int> parent = elimination_tree(sequence, adjacency);

  place_.resize(n);
  size_.resize(n);
  start_.resize(n + 1);
  given_start_.resize(n + 1);
  for (int k = 0; k < n; ++k) {
    place_[sequence[k]] = k;
    size_[k] = sizes[sequence[k]];
    start_[k + 1] = start_[k] + size_[k];
    given_start_[k + 1] = given_start_[k] + sizes[k];
  }
  rows_ = given_start_[n];

  // structure[k]: the nodes below k in column k of L: its neighbours and what its children leave behind.
  std::vector<std::vector<int>> structure(n);
  std::vector<int> mark(n, -1);
  std::vector<std::vector<int>> children(n);
  for (int k = 0; k < n; ++k) {
    mark[k] = k;
    const auto add = [&](int i) {
      if (i <= k || mark[i] == k) return;
      mark[i] = k;
      structure[k].push_back(i);
    };
    for (int neighbour : adjacency[sequence[k]]) add(place_[neighbour]);
    for (int child : children[k])
      for (int i : structure[child]) add(i);
    std::sort(structure[k].begin(), structure[k].end());
    if (parent[k] >= 0) children[parent[k]].push_back(k);
  }
  find_supernodes(structure, parent);
}

void BlockCholesky::find_supernodes(const std::vector<std::vector<int>>& structure,
                                    const std::vector<int>& parent) {
  const int n = static_cast<int>(structure.size());
  const auto scalar_rows = [&](int k) {
    int rows = 0;
    for (int i : structure[k]) rows += size_[i];
    return rows;
  };
  supernode_of_.resize(n);
  for (int first = 0; first < n;) {
    int last = first, columns = size_[first], below = scalar_rows(first);
    std::size_t zeros = 0;
    while (last + 1 < n && parent[last] == last + 1) {
      // Taking the parent in gives every column so far the rows that only the parent has.
      const int parent_below = scalar_rows(last + 1), extra = parent_below + size_[last + 1] - below;
      const std::size_t next_zeros = zeros + static_cast<std::size_t>(extra) * columns;
      const int next_columns = columns + size_[last + 1];
      const std::size_t panel = static_cast<std::size_t>(next_columns) * (next_columns + parent_below);
      if (next_zeros > relaxed_zeros * panel && next_columns > small_panel) break;
      ++last;
      zeros = next_zeros;
      columns = next_columns;
      below = parent_below;
    }
    Supernode s{first, last + 1, structure[last], {}, {}, columns, columns + below, 0};
    for (int k = first; k <= last; ++k) supernode_of_[k] = static_cast<int>(supernodes_.size());
    supernodes_.push_back(std::move(s));
    first = last + 1;
  }
  for (std::size_t c = 0; c < supernodes_.size(); ++c) {
    Supernode& child = supernodes_[c];
    if (child.row_nodes.empty()) continue;
    Supernode& p = supernodes_[supernode_of_[child.row_nodes.front()]];
    p.children.push_back(static_cast<int>(c));
    int row = p.columns;
    auto below = p.row_nodes.begin();
    for (int node : child.row_nodes) {
      if (node < p.end_node) {
        child.child_rows.push_back(start_[node] - start_[p.first_node]);
        continue;
      }
      for (; *below != node; ++below) row += size_[*below];
      child.child_rows.push_back(row);
    }
  }
}

BlockCholesky::Slot BlockCholesky::slot(int i, int j) const {
  int row = place_[i], column = place_[j];
  const bool transposed = row < column;
  if (transposed) std::swap(row, column);
  const Supernode& s = supernodes_[supernode_of_[column]];
  int scalar_row;
  if (row < s.end_node) {
    scalar_row = start_[row] - start_[s.first_node];
  } else {
    scalar_row = s.columns;
    for (int node : s.row_nodes) {
      if (node == row) break;
      scalar_row += size_[node];
    }
  }
  const int scalar_column = start_[column] - start_[s.first_node];
  return {s.panel + static_cast<std::size_t>(scalar_column) * s.front + scalar_row, s.front, transposed};
}

void BlockCholesky::set_zero() { std::fill(panels_.begin(), panels_.end(), 0.0); }

void BlockCholesky::extend_add(const Supernode& child, const double* update, int update_size, double* front,
                               int stride) const {
  int column = 0;
  for (std::size_t b = 0; b < child.row_nodes.size(); ++b) {
    for (int q = 0; q < size_[child.row_nodes[b]]; ++q, ++column) {
      double* to = front + static_cast<std::size_t>(child.child_rows[b] + q) * stride;
      const double* from = update + static_cast<std::size_t>(column) * update_size;
      int row = column - q;
      for (std::size_t a = b; a < child.row_nodes.size(); ++a) {
        const int size = size_[child.row_nodes[a]];
        for (int p = 0; p < size; ++p) to[child.child_rows[a] + p] += from[row + p];
        row += size;
      }
    }
  }
}

int BlockCholesky::factor() {
  int replaced = 0;
  std::size_t top = 0;
  for (const Supernode& s : supernodes_) {
    const int stride = (s.front + 7) / 8 * 8;
    double* F = front_.data();
    double* panel = panels_.data() + s.panel;
    for (int j = 0; j < s.columns; ++j)
      std::copy(panel + static_cast<std::size_t>(j) * s.front,
                panel + static_cast<std::size_t>(j + 1) * s.front, F + static_cast<std::size_t>(j) * stride);
    // Only lower triangles are kept: the kernel reads, and never uses, what lies above.
    for (int j = s.columns; j < s.front; ++j)
      std::fill(F + static_cast<std::size_t>(j) * stride + j,
                F + static_cast<std::size_t>(j) * stride + s.front, 0.0);
    for (auto c = s.children.rbegin(); c != s.children.rend(); ++c) {
      const Supernode& child = supernodes_[*c];
      const int rest = child.front - child.columns;
      top -= static_cast<std::size_t>(rest) * rest;
      extend_add(child, stack_.data() + top, rest, F, stride);
    }
    replaced += AMONTONS_DISPATCH(partial_cholesky, F, s.front, stride, s.columns, work_.data());
    for (int j = 0; j < s.columns; ++j)
      std::copy(F + static_cast<std::size_t>(j) * stride, F + static_cast<std::size_t>(j) * stride + s.front,
                panel + static_cast<std::size_t>(j) * s.front);
    const int rest = s.front - s.columns;
    for (int j = 0; j < rest; ++j) {
      const double* column = F + static_cast<std::size_t>(s.columns + j) * stride + s.columns;
      std::copy(column + j, column + rest, stack_.data() + top + static_cast<std::size_t>(j) * rest + j);
    }
    top += static_cast<std::size_t>(rest) * rest;
  }
  return replaced;
}

void BlockCholesky::solve(std::span<double> rhs) {
  double* y = work_.data();
  double* rest = y + rows_;
  for (std::size_t i = 0; i < place_.size(); ++i)
    std::copy(&rhs[given_start_[i]], &rhs[given_start_[i]] + size_[place_[i]], y + start_[place_[i]]);
  const auto for_each_row = [&](const Supernode& s, auto&& f) {
    int local = 0;
    for (int node : s.row_nodes)
      for (int q = 0; q < size_[node]; ++q) f(local++, start_[node] + q);
  };
  for (const Supernode& s : supernodes_) {  // L y = rhs
    AMONTONS_DISPATCH(panel_forward, panels_.data() + s.panel, s.front, s.columns, y + start_[s.first_node],
                      rest);
    for_each_row(s, [&](int local, int row) { y[row] -= rest[local]; });
  }
  for (auto s = supernodes_.rbegin(); s != supernodes_.rend(); ++s) {  // L' x = y
    for_each_row(*s, [&](int local, int row) { rest[local] = y[row]; });
    AMONTONS_DISPATCH(panel_backward, panels_.data() + s->panel, s->front, s->columns,
                      y + start_[s->first_node], rest);
  }
  for (std::size_t i = 0; i < place_.size(); ++i)
    std::copy(y + start_[place_[i]], y + start_[place_[i] + 1], &rhs[given_start_[i]]);
}

}  // namespace amontons
