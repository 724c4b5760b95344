// Multifrontal factorisation, after Liu 1992. Names: a node is a block of rows in elimination order. A
// supernode is a run of nodes whose columns of L have (nearly) the same rows, held as one dense panel.
// Analysis, once:
//  1. an order with little fill, on the graph of blocks: block_order.cpp;
//  2. the elimination tree: parent(k) is the first row below k in column k of L. Column k changes only
//     columns on the path from k to the root, so that subtrees are independent of each other;
//  3. a postorder of the tree: each subtree is contiguous, directly before its parent;
//  4. the rows of every column, from those of its children; supernodes; and the place of each row of a child
//     in the front of its parent.
// factor() visits the supernodes in that order. Its front F is a dense matrix over the columns of the
// supernode and the rows below them,
//  F = | F11  .  |  =  the panel of A   +   the update matrices of the children (extend-add)
//      | F21 F22 |
//  F11 = L11 L11',  L21 = F21 L11^-T,  U = F22 - L21 L21'.
// L11 and L21 are columns of L and go to the panel. U is the update matrix: what this subtree subtracts from
// the rest. It waits on a stack for the parent. In a postorder the children of the next supernode are on the
// top.
#include "amontons/solvers/linear/block_cholesky.hpp"

#include <algorithm>
#include <atomic>

#include "amontons/base/leave.hpp"
#include "solvers/linear/block_order.hpp"
#include "solvers/linear/front_kernel.hpp"

namespace amontons {

namespace {

// Supernodes are merged while explicit zeros stay below this fraction of the panel, or the panel is small:
// dense kernels on slightly larger fronts are faster than many tiny ones. Six columns are one body: bodies
// are merged only for few zeros, single rows and cones of a matrix always. On a wall of bricks it adds 20 %
// to the entries.
constexpr double relaxed_zeros = 0.15;
constexpr int small_panel = 6;

// Postorder of a forest, as the matrix may be block diagonal. Not recursive, since a tree may be as deep as a
// chain is long.
std::vector<int> postorder(const std::vector<int>& parent) {
  const int n = static_cast<int>(parent.size());
  std::vector<std::vector<int>> children(n);
  std::vector<int> stack, order;
  for (int i = n - 1; i >= 0; --i) (parent[i] < 0 ? stack : children[parent[i]]).push_back(i);
  std::reverse(stack.begin(), stack.end());
  // Preorder with reversed children, read backwards, is a postorder.
  while (!stack.empty()) {
    const int i = stack.back();
    stack.pop_back();
    order.push_back(i);
    for (int child : children[i]) stack.push_back(child);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

// Time per multiplication of a factorisation (s), from the last one of some length; only deadlines use it.
// The first value is that of a slow machine.
std::atomic<double> pace{5e-10};
// Time per entry of new memory, whose pages come at first touch, and of memory that is filled again (s).
constexpr double new_entry = 2.5e-9, filled_entry = 5e-10;

}  // namespace

BlockCholesky::BlockCholesky(std::span<const int> sizes, std::span<const std::pair<int, int>> edges,
                             std::span<const Vec3> positions) {
  order(sizes, edges, positions);
  // Sizes of the memory, by simulating the factorisation: the panels one behind the other, the largest front,
  // and the largest stack of update matrices. Each supernode removes the matrices of its children from the
  // stack and adds its own.
  std::size_t panel_entries = 0, stack = 0;
  for (Supernode& s : supernodes_) {
    s.panel = panel_entries;
    panel_entries += static_cast<std::size_t>(s.front) * s.columns;
    // Each column k of a front subtracts its square from the triangle right of it.
    for (double k = 0; k < s.columns; ++k) factor_work_ += 0.5 * (s.front - k) * (s.front - k);
    largest_front_ = std::max<std::size_t>(largest_front_, s.front);
    for (int c : s.children) {
      const std::size_t rest = supernodes_[c].front - supernodes_[c].columns;
      stack -= rest * rest;
    }
    const std::size_t rest = s.front - s.columns;
    stack += rest * rest;
    largest_stack_ = std::max(largest_stack_, stack);
  }
  panel_entries_ = panel_entries + 7;  // kernels add zeros to up to seven entries past a block
  leave_if_due(new_entry * side_entries() + seconds());
}

double BlockCholesky::side_entries() const {
  return static_cast<double>(panel_entries_ + largest_front_ * (largest_front_ + 8) + largest_stack_);
}

void BlockCholesky::allocate(Triangle& side) {
  side.panels.resize(panel_entries_);
  side.front.resize(largest_front_ * (largest_front_ + 8));
  side.stack.resize(largest_stack_);
  // One scratch array for two uses: the packed panel of factor(), the vectors of solve().
  work_.resize(
      std::max<std::size_t>(front_pack_size(static_cast<int>(largest_front_)), rows_ + largest_front_));
}

// Steps 1 to 4 of the analysis. The order ignores scalar sizes: blocks of a graph mostly have one size.
void BlockCholesky::order(std::span<const int> sizes, std::span<const std::pair<int, int>> edges,
                          std::span<const Vec3> positions) {
  const int n = static_cast<int>(sizes.size());
  BlockGraph adjacency(n);
  // The graph of blocks, in both directions, each neighbour once.
  for (auto [i, j] : edges) {
    if (i == j) continue;
    adjacency[i].push_back(j);
    adjacency[j].push_back(i);
  }
  leave_if_due();
  for (auto& neighbours : adjacency) {
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
  }
  // Relabel in postorder: a supernode is then a range of nodes, and children precede parents on a stack.
  const std::vector<int> found = order_blocks(adjacency, positions);
  const std::vector<int> post = postorder(elimination_tree(found, adjacency));
  leave_if_due();
  std::vector<int> sequence(n);
  for (int k = 0; k < n; ++k) sequence[k] = found[post[k]];
  const std::vector<int> parent = elimination_tree(sequence, adjacency);

  // Three numberings of blocks: as given (place_, given_start_), in the order found, in elimination order
  // (size_, start_).
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

  // structure[k]: the nodes below k in column k of L: its neighbours and the remaining nodes of its children.
  std::vector<std::vector<int>> structure(n);
  std::vector<int> mark(n, -1);
  std::vector<std::vector<int>> children(n);
  for (int k = 0; k < n; ++k) {
    if (k % 64 == 63) leave_if_due();
    mark[k] = k;
    // mark[i] = k: structure[k] already contains node i.
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

// From the first node upwards: the next node joins if it is the parent of the last one and the zeros stay
// few. In a postorder parent(k) = k + 1 means that k is the last child of k + 1. The rows of column k of L
// below k then lie within {k + 1} and those of column k + 1.
//
// Then every supernode becomes a child of the one that contains its first row below the diagonal. Each of its
// rows gets a place in that front: among its columns, or among the rows below them, which ascend in both.
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
    // columns, below: scalar columns of the supernode so far and scalar rows below its last. zeros: entries
    // of its panel that are zero in L.
    int last = first, columns = size_[first], below = scalar_rows(first);
    std::size_t zeros = 0;
    while (last + 1 < n && parent[last] == last + 1) {
      // Adding the parent gives every column so far the rows that only the parent has.
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
    // A root: nothing lies below its columns.
    if (child.row_nodes.empty()) continue;
    Supernode& p = supernodes_[supernode_of_[child.row_nodes.front()]];
    p.children.push_back(static_cast<int>(c));
    // row: the place of *below in the front of the parent; both advance together.
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

// Only the lower triangle is stored: block (i, j) is in the panel of the earlier one in the order, as a
// column. The place is found by a search over the rows, once per block of the pattern.
BlockCholesky::Slot BlockCholesky::slot(int i, int j) const {
  int row = place_[i], column = place_[j];
  const bool transposed = row < column;
  if (transposed) std::swap(row, column);
  const Supernode& s = supernodes_[supernode_of_[column]];
  // In the panel: among the columns of the supernode, or below them.
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

double BlockCholesky::seconds() const {
  return (symmetric_ ? 1 : 2) * factor_work_ * pace.load(std::memory_order_relaxed);
}

void BlockCholesky::set_zero(bool symmetric) {
  symmetric_ = symmetric;
  const std::span<Triangle> sides(sides_, symmetric ? 1 : 2);
  double time = seconds();
  for (const Triangle& side : sides)
    time +=
        side.panels.empty() ? new_entry * side_entries() : filled_entry * static_cast<double>(panel_entries_);
  leave_if_due(time);
  for (Triangle& side : sides)
    if (side.panels.empty())
      allocate(side);
    else
      std::fill(side.panels.begin(), side.panels.end(), 0.0);
}

// front += update of a child (lower triangle, by columns). Node b of its rows is the block column, node a >=
// b the block row; q and p run over the scalars inside, and child_rows gives their places. Rows ascend in the
// parent as in the child, so that lower triangles stay lower. The upper half of diagonal blocks is undefined;
// it is copied but not used.
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

namespace {

// Work (multiplications): shorter factorisations do not update the pace.
constexpr double shortest_measured = 1e6;

// Multiplications between two readings of the clock: a tenth of a millisecond.
constexpr double unwatched_work = 3e5;

// A front in pieces of some columns each. The kernels subtract from all columns to the right, so that the
// next piece is a front of its own. Every entry sees the same operations in the same order. upper: null if
// the matrix is symmetric.
int factor_front(double* lower, double* upper, int front, int stride, int columns, double* pack) {
  int replaced = 0;
  for (int first = 0; first < columns;) {
    const double rest = front - first;
    const int panels = 1 + static_cast<int>(unwatched_work / (front_panel * rest * rest));
    const int piece = std::min(columns - first, panels * front_panel);
    const std::size_t corner = static_cast<std::size_t>(first) * stride + first;
    replaced += upper
                    ? AMONTONS_DISPATCH(partial_lu, lower + corner, upper + corner, front - first, stride,
                                        piece, pack)
                    : AMONTONS_DISPATCH(partial_cholesky, lower + corner, front - first, stride, piece, pack);
    first += piece;
    if (first < columns) leave_if_due();
  }
  return replaced;
}

// Distance of columns: a multiple of eight doubles, whole registers in the kernel.
int stride_of(int front) { return (front + 7) / 8 * 8; }

}  // namespace

// Assembles the front of a supernode: F11 and F21 from the panel, where A was assembled; F22 zero. Adds the
// updates of its children, which lie on the stack below `top`, the last child's on the top.
void BlockCholesky::take(Triangle& of, const Supernode& s, std::size_t top) const {
  const int stride = stride_of(s.front);
  double* F = of.front.data();
  const double* panel = of.panels.data() + s.panel;
  for (int j = 0; j < s.columns; ++j)
    std::copy(panel + static_cast<std::size_t>(j) * s.front,
              panel + static_cast<std::size_t>(j + 1) * s.front, F + static_cast<std::size_t>(j) * stride);
  // Only lower triangles are kept: the kernel reads the entries above but does not use them.
  for (int j = s.columns; j < s.front; ++j)
    std::fill(F + static_cast<std::size_t>(j) * stride + j,
              F + static_cast<std::size_t>(j) * stride + s.front, 0.0);
  for (auto c = s.children.rbegin(); c != s.children.rend(); ++c) {
    const Supernode& child = supernodes_[*c];
    const int rest = child.front - child.columns;
    top -= static_cast<std::size_t>(rest) * rest;
    extend_add(child, of.stack.data() + top, rest, F, stride);
  }
}

// Copies L11 and L21 to the panel and U to the stack, in place of the children's updates.
void BlockCholesky::leave(Triangle& of, const Supernode& s, std::size_t top) const {
  const int stride = stride_of(s.front), rest = s.front - s.columns;
  const double* F = of.front.data();
  double* panel = of.panels.data() + s.panel;
  for (int j = 0; j < s.columns; ++j)
    std::copy(F + static_cast<std::size_t>(j) * stride, F + static_cast<std::size_t>(j) * stride + s.front,
              panel + static_cast<std::size_t>(j) * s.front);
  for (int j = 0; j < rest; ++j) {
    const double* column = F + static_cast<std::size_t>(s.columns + j) * stride + s.columns;
    std::copy(column + j, column + rest, of.stack.data() + top + static_cast<std::size_t>(j) * rest + j);
  }
}

// Fronts on the way to the root: take the panel and the children's updates, factor, return the panel, push U.
int BlockCholesky::factor() {
  int replaced = 0;
  std::size_t top = 0;
  const double work = (symmetric_ ? 1 : 2) * factor_work_;
  const std::span<Triangle> sides(sides_, symmetric_ ? 1 : 2);
  leave_if_due(seconds());
  const auto start = std::chrono::steady_clock::now();
  double watched = 0;  // work since the last reading of the clock
  for (const Supernode& s : supernodes_) {
    watched += 0.5 * s.columns * static_cast<double>(s.front) * s.front;
    if (watched > unwatched_work) {
      watched = 0;
      leave_if_due();
    }
    for (Triangle& side : sides) take(side, s, top);
    replaced += factor_front(sides_[lower].front.data(), symmetric_ ? nullptr : sides_[upper].front.data(),
                             s.front, stride_of(s.front), s.columns, work_.data());
    const auto square = [](int n) { return static_cast<std::size_t>(n) * n; };
    for (int c : s.children) top -= square(supernodes_[c].front - supernodes_[c].columns);
    for (Triangle& side : sides) leave(side, s, top);
    top += square(s.front - s.columns);
  }
  if (work > shortest_measured)
    pace.store(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / work,
               std::memory_order_relaxed);
  return replaced;
}

// In L U the diagonal of U has the signs of the pivots.
int BlockCholesky::sign() const {
  if (symmetric_) return 1;
  int sign = 1;
  for (const Supernode& s : supernodes_)
    for (int j = 0; j < s.columns; ++j)
      if (sides_[upper].panels[s.panel + static_cast<std::size_t>(j) * (s.front + 1)] < 0) sign = -sign;
  return sign;
}

// L y = rhs from the leaves to the root, L'x = y (or U x = y) back. The rows of a panel's own columns are
// contiguous; the rows below are not, so panels work on a copy of them.
void BlockCholesky::solve(std::span<double> rhs) {
  // y: the unknowns in elimination order. rest: the rows below a panel.
  double* y = work_.data();
  double* rest = y + rows_;
  const Triangle& back = sides_[symmetric_ ? lower : upper];
  for (std::size_t i = 0; i < place_.size(); ++i)
    std::copy(&rhs[given_start_[i]], &rhs[given_start_[i]] + size_[place_[i]], y + start_[place_[i]]);
  const auto for_each_row = [&](const Supernode& s, auto&& f) {
    int local = 0;
    for (int node : s.row_nodes)
      for (int q = 0; q < size_[node]; ++q) f(local++, start_[node] + q);
  };
  // Forward: `rest` first sums what the columns of a supernode subtract from the rows below.
  for (const Supernode& s : supernodes_) {  // L y = rhs
    AMONTONS_DISPATCH(panel_forward, sides_[lower].panels.data() + s.panel, s.front, s.columns,
                      y + start_[s.first_node], rest);
    for_each_row(s, [&](int local, int row) { y[row] -= rest[local]; });
  }
  // Backward: the rows below are known, because they belong to ancestors.
  for (auto s = supernodes_.rbegin(); s != supernodes_.rend(); ++s) {  // L' x = y
    for_each_row(*s, [&](int local, int row) { rest[local] = y[row]; });
    AMONTONS_DISPATCH(panel_backward, back.panels.data() + s->panel, s->front, s->columns,
                      y + start_[s->first_node], rest);
  }
  for (std::size_t i = 0; i < place_.size(); ++i)
    std::copy(y + start_[place_[i]], y + start_[place_[i] + 1], &rhs[given_start_[i]]);
}

}  // namespace amontons
