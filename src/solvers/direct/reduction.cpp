// W is formed on the way up the elimination tree. The six rows of Z of a node are complete once its children
// have passed on their parts. They contribute to Z'S Z at once, while they are in the cache. A solve with K
// per column would also need the way down; this one does not.
#include "solvers/direct/reduction.hpp"

#include <algorithm>

#include "solvers/linear/row_kernel.hpp"

namespace amontons {

namespace {

// Whether the matrix of an island has more than `most_rows` rows: those beside its bilateral ones, or its
// coordinates if it has trees and these are fewer. Bilateral rows join bodies as other rows do: these islands
// are those of find_islands(), which needs the mechanisms for them. The analysis would number all bodies of a
// pile, order its elimination, sort its blocks, and come to the same answer. Problems of few rows skip the
// test: they have no large island.
//
// Rows beyond the coordinates add to a step in proportion, m n^2 in place of m^3 / 3, as contacts do in a
// method that works on accelerations. A cube of 26 parts has 126 coordinates and 900 rows of contacts.
// Islands of free bodies alone count rows: a pile has a sparse matrix in iterations, beside a robot, too. All
// coordinates of a tree count, also those that no row of the island reaches: the rows that tell are not made
// yet.
bool has_large_island(const Problem& problem, const ContactSystem& A, std::size_t most_rows) {
  if (problem.rows() <= most_rows) return false;
  struct Size {
    std::size_t rows = 0, coordinates = 0;
    bool has_trees = false;
  };
  static thread_local std::vector<Size> size;  // kept: a step allocates nothing
  static thread_local std::vector<Index> island_of;
  const Islands& islands = problem.graph.islands;
  size.assign(islands.count, {});
  for (const SetRun& run : problem.K.runs()) {
    if (run.kind == kind_of<Bilateral>) continue;
    visit_kind(run.kind, [&]<class S>() {
      for (std::size_t i = 0; i < run.count; ++i) size[islands.of_block[run.block + i]].rows += S::dim;
    });
  }
  if (const Linkage* trees = linkage_of(A)) {
    // Per coordinate: the island of its tree. The last coordinate of a body tells it to the root.
    island_of.assign(trees->coordinates(), -1);
    for (std::size_t i = 0; i < islands.of_body.size(); ++i) {
      const Index island = islands.of_body[i], own = trees->number_of(static_cast<Index>(i));
      if (island < 0) continue;
      if (own < 0) size[island].coordinates += 6;
      for (Index k = own < 0 ? -1 : trees->last[own]; k >= 0 && island_of[k] < 0; k = trees->parent[k])
        island_of[k] = island;
    }
    for (std::size_t k = 0; k < island_of.size(); ++k) {
      if (const Index above = trees->parent[k]; above >= 0) island_of[k] = island_of[above];
      if (island_of[k] < 0) continue;
      ++size[island_of[k]].coordinates;
      size[island_of[k]].has_trees = true;
    }
  }
  return std::any_of(size.begin(), size.end(), [most_rows](const Size& own) {
    return (own.has_trees ? std::min(own.rows, own.coordinates) : own.rows) > most_rows;
  });
}

// Whether m rows over n coordinates take fewer multiplications in factors, which is so from m = 1.6 n.
//
// By rows there are W and the factors of Newton's matrix of m rows. By rates there are a matrix of n rows, to
// which each row of the problem adds n^2 products, and its factors. W is made once, the rest in each Newton
// step, of which most solves take two.
bool is_thin(std::size_t m, std::size_t n) {
  const std::size_t by_rates = 2 * (m * n * n + n * n * n / 3);     // not tuned: counted
  const std::size_t by_rows = m * m * n / 2 + 2 * (m * m * m / 3);  // not tuned: counted
  return n > 0 && by_rates < by_rows;
}

// Calls put(row of the block, place, value) for the entries of the rows of a block. Contacts form their
// rows here; joints have stored ones.
template <class Put>
void visit_block(const Problem& problem, const MotionNodes& nodes, const IslandBlock& block, const Put& put) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contact_rows = problem.rows() - A.jacobian.size();
  const auto visit = [&](std::size_t k, const JacobianRow& D) {
    nodes.visit_row(A, block.row + k, D, [&](std::size_t at, double value) { put(k, at, value); });
  };
  if (block.row < contact_rows) {
    const ContactGeometry& c = A.contacts[block.block];
    const ContactBasis basis(c);
    for (std::size_t k = 0; k < block.dim; ++k) visit(k, jacobian_row(c, basis, static_cast<int>(k)));
  } else {
    for (std::size_t k = 0; k < block.dim; ++k) visit(k, A.jacobian[block.row + k - contact_rows]);
  }
}

}  // namespace

// Piles are recognised by their links alone, which the problem has already. The analysis of so many bodies
// costs as much as many products.
bool Reduction::analyse(const Problem& problem, std::size_t most_rows) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || (A->constrained && !A->constrained->linkage) || has_large_island(problem, *A, most_rows))
    return false;
  mechanism_.analyse(problem);
  if (!mechanism_.takes_little()) return false;
  find_islands(problem);
  return true;
}

void Reduction::find_islands(const Problem& problem) {
  const auto first = [this](const ContactGraph::Link& link) {
    const Index a = mechanism_.last_node(link.a), b = mechanism_.last_node(link.b);
    return a < 0 || b < 0 ? std::max(a, b) : std::min(a, b);
  };
  count_ = sort_into_islands(problem, false, first, rest_);
  first_block_.assign(count_ + 1, 0);
  for (const IslandBlock& r : rest_) ++first_block_[r.island + 1];
  for (std::size_t i = 0; i < count_; ++i) first_block_[i + 1] += first_block_[i];
}

bool Reduction::factor(const Problem& problem) {
  if (!mechanism_.factor(problem)) return false;
  if (!mechanism_.rows().empty()) {
    mechanism_.right_side(problem.b, z_);
    mechanism_.K().forward(z_.data());
  }
  fill_islands(problem);
  place_columns(problem);
  start_columns(problem);
  sweep();
  finish_islands();
  return true;
}

// At a node with c columns the upper half of the Gram product takes 6 c^2 / 2 multiplications, the solve and
// the update of the parent 36 c.
double Reduction::work() const {
  double sum = mechanism_.K().work();
  for (const Range& range : range_)
    if (range.first < range.last) {
      const auto columns = static_cast<double>(range.size());
      sum += columns * width * (0.5 * columns + width);
    }
  return sum;
}

// Sets, P, rows, q = b_c and W = E_c, in the order of the columns; or E_c and Y_c of a W in factors.
void Reduction::fill_islands(const Problem& problem) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contact_rows = problem.rows() - A.jacobian.size();
  const bool has_trees = linkage_of(A), held = !mechanism_.rows().empty();
  if (islands_.size() < count_) islands_.resize(count_);
  if (used_.size() < count_) used_.resize(count_);
  compact_.assign(width * mechanism_.K().nodes(), -1);
  first_column_.assign(count_ + 1, 0);
  for (std::size_t i = 0; i < count_; ++i) {
    Island& island = islands_[i];
    island.clear();
    std::vector<std::size_t>& used = used_[i];
    used.clear();
    for (std::size_t r = first_block_[i]; r < first_block_[i + 1]; ++r) island.add(problem, rest_[r]);
    const std::size_t m = island.rows();
    if (has_trees) find_used(problem, i);
    const bool thin = has_trees && is_thin(m, used.size());
    first_column_[i + 1] = first_column_[i] + (!thin ? m : held ? used.size() : 0);
    island.W.assign(thin ? 0 : m * m, 0.0);
    island.thin.resize(thin ? used.size() : 0, thin ? m : 0);
    std::size_t row = 0;
    for (std::size_t r = first_block_[i]; r < first_block_[i + 1]; ++r) {
      const IslandBlock& b = rest_[r];
      for (std::size_t k = 0; k < b.dim; ++k)
        (thin ? island.thin.E[row + k] : island.W[(m + 1) * (row + k)]) =
            b.row < contact_rows ? A.contact_compliance[b.block] : A.compliance[b.row + k - contact_rows];
      if (thin)
        visit_block(problem, mechanism_.nodes(), b, [&](std::size_t k, std::size_t at, double value) {
          island.thin.Y[island.thin.stride * (row + k) + compact_[at]] = value;
        });
      row += b.dim;
    }
    for (const std::size_t k : used) compact_[k] = -1;
  }
}

// The coordinates that rows of the island reach, in the order of K, and their places among them. Those of its
// bodies would be too many: a row along a coordinate reaches none of the others that a joint or a chain puts
// beyond.
void Reduction::find_used(const Problem& problem, std::size_t island) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const MotionNodes& nodes = mechanism_.nodes();
  std::vector<std::size_t>& used = used_[island];
  const auto use = [&](int at) {
    if (compact_[at] >= 0) return;
    compact_[at] = 0;
    used.push_back(static_cast<std::size_t>(at));
  };
  for (std::size_t r = first_block_[island]; r < first_block_[island + 1]; ++r) {
    const IslandBlock& b = rest_[r];
    for (std::size_t k = A.half.first[b.row]; k < A.half.first[b.row + b.dim]; ++k)
      use(nodes.entry[A.half.coordinate[k]]);
    const ContactGraph::Link& link = problem.graph.links[b.block];
    for (const Index body : {link.a, link.b})
      if (body >= 0 && nodes.of_body[body] >= 0)
        for (int k = 0; k < 6; ++k) use(nodes.entry_of_body[body] + k);
  }
  std::sort(used.begin(), used.end());
  for (std::size_t i = 0; i < used.size(); ++i) compact_[used[i]] = static_cast<Index>(i);
}

void Reduction::Island::clear() {
  K.clear();
  q.clear();
  P.clear();
  row.clear();
}

void Reduction::Island::add(const Problem& problem, const IslandBlock& b) {
  visit_kind(b.kind, [&]<class S>() { K.append(problem.K.all<S>()[b.set]); });
  P.push_back(problem.P[b.block]);
  for (std::size_t i = b.row; i < b.row + b.dim; ++i) {
    row.push_back(i);
    q.push_back(problem.b[i]);
  }
}

// The range of a node is the hull of the ranges of its children and of the columns that begin there. Columns
// of one island are adjacent, so no range contains columns of two islands.
void Reduction::place_columns(const Problem& problem) {
  const QuasidefiniteFactor& K = mechanism_.K();
  // An empty range: its first column is after its last.
  range_.assign(K.nodes(), {~std::size_t{0}, 0, 0});
  island_of_node_.assign(K.nodes(), -1);
  row_.resize(width * K.nodes());
  const auto begin = [this](std::size_t place, std::size_t column, std::size_t count, std::size_t island) {
    Range& range = range_[place];
    range.first = std::min(range.first, column);
    range.last = std::max(range.last, column + count);
    island_of_node_[place] = static_cast<Index>(island);
  };
  for (std::size_t i = 0; i < count_; ++i) {
    std::size_t column = first_column_[i];
    if (column == first_column_[i + 1]) continue;
    if (!islands_[i].thin.empty())
      for (const std::size_t k : used_[i]) begin(k / width, column++, 1, i);
    else
      for (std::size_t r = first_block_[i]; r < first_block_[i + 1]; ++r) {
        const ContactGraph::Link& link = problem.graph.links[rest_[r].block];
        for (const Index body : {link.a, link.b})
          mechanism_.nodes().visit_nodes(body, [&](int node) {
            begin(static_cast<std::size_t>(mechanism_.position(node)), column, rest_[r].dim, i);
          });
        column += rest_[r].dim;
      }
  }
  std::size_t size = 0;
  for (std::size_t k = 0; k < K.nodes(); ++k) {
    Range& range = range_[k];
    if (range.first >= range.last) continue;
    range.at = size;
    size += width * range.stride();
    for (std::size_t i = 0; i < width; ++i) row_[width * k + i] = range.at + i * range.stride() - range.first;
    if (const Index p = K.parent(k); p >= 0) {
      range_[p].first = std::min(range_[p].first, range.first);
      range_[p].last = std::max(range_[p].last, range.last);
      island_of_node_[p] = island_of_node_[k];
    }
  }
  // The padding of the last row of a child may exceed that of its parent.
  Z_.assign(size + lanes, 0.0);
}

// Writes Y_c' at the nodes where the columns start; of a W in factors the unit vectors.
void Reduction::start_columns(const Problem& problem) {
  for (std::size_t i = 0; i < count_; ++i) {
    std::size_t column = first_column_[i];
    if (column == first_column_[i + 1]) continue;
    if (!islands_[i].thin.empty())
      for (const std::size_t at : used_[i]) Z_[row_[at] + column++] = 1;
    else
      for (std::size_t r = first_block_[i]; r < first_block_[i + 1]; column += rest_[r++].dim)
        visit_block(problem, mechanism_.nodes(), rest_[r],
                    [&](std::size_t k, std::size_t at, double value) { Z_[row_[at] + column + k] = value; });
  }
}

// Z = L^-1 (Y_c', 0) from the leaves to the roots; W and q are formed on the way.
void Reduction::sweep() {
  const QuasidefiniteFactor& K = mechanism_.K();
  sums_.assign(first_column_.back(), 0.0);
  for (std::size_t i = 0; i < count_; ++i)
    if (ThinMatrix& thin = islands_[i].thin; !thin.empty() && first_column_[i] < first_column_[i + 1])
      thin.Q.assign(thin.n * thin.stride, 0.0);
  for (std::size_t k = 0; k < K.nodes(); ++k) {
    const Range& range = range_[k];
    if (range.first >= range.last) continue;
    double* Z = &Z_[range.at];
    if (!K.is_unit(k)) K.forward_node(k, Z, range.stride());
    for (std::size_t slot = K.first_slot(k); slot < K.last_slot(k); ++slot) {
      const Range& above = range_[K.above(slot)];
      K.forward_update(slot, K.sign(k), Z, range.stride(), &Z_[above.at + range.first - above.first],
                       above.stride());
    }
    add_products(k, range);
  }
}

// W += s Z'Z (upper half) and q += s Z'z for one node.
void Reduction::add_products(std::size_t node, const Range& range) {
  Island& island = islands_[island_of_node_[node]];
  const bool thin = !island.thin.empty();
  const std::size_t at = range.first - first_column_[island_of_node_[node]], size = range.size();
  const std::size_t stride = thin ? island.thin.stride : island.rows();
  const int s = mechanism_.K().sign(node);
  AMONTONS_DISPATCH(add_gram, &(thin ? island.thin.Q : island.W)[(stride + 1) * at], stride, &Z_[range.at],
                    range.stride(), size, s);
  if (mechanism_.rows().empty()) return;
  double z[width];
  for (std::size_t k = 0; k < width; ++k) z[k] = s * z_[width * node + k];
  AMONTONS_DISPATCH(add_six_rows, &sums_[range.first], z, &Z_[range.at], range.stride(), size);
}

// The lower halves, and q from the sums: those of rows, or Y_c times those of coordinates.
void Reduction::finish_islands() {
  static thread_local std::vector<double> sums;
  for (std::size_t i = 0; i < count_; ++i) {
    Island& island = islands_[i];
    const bool thin = !island.thin.empty();
    const std::size_t n = first_column_[i + 1] - first_column_[i];
    const std::size_t stride = thin ? island.thin.stride : n;
    std::vector<double>& matrix = thin ? island.thin.Q : island.W;
    for (std::size_t r = 0; r < n; ++r)
      for (std::size_t c = 0; c < r; ++c) matrix[stride * r + c] = matrix[stride * c + r];
    if (mechanism_.rows().empty()) continue;
    const double* sum = &sums_[first_column_[i]];
    if (thin) {
      sums.assign(stride, 0.0);
      std::copy_n(sum, n, sums.begin());
      AMONTONS_DISPATCH(add_row_products, island.q.data(), island.thin.Y.data(), sums.data(), island.rows(),
                        stride);
    } else {
      for (std::size_t c = 0; c < n; ++c) island.q[c] += sum[c];
    }
  }
}

// L^-1 (Y_c'x_c, -b_f) = Z x_c + z, then up the tree. Islands with W in factors have Y_c in place of Z.
void Reduction::recover(std::span<double> x) {
  if (mechanism_.rows().empty()) return;
  const QuasidefiniteFactor& K = mechanism_.K();
  solution_.assign(z_.size(), 0.0);
  static thread_local std::vector<double> own, along;  // kept: a step allocates nothing
  along.clear();
  for (std::size_t i = 0; i < count_; ++i) {
    const ThinMatrix& thin = islands_[i].thin;
    if (thin.empty()) continue;
    own.clear();
    for (const std::size_t row : islands_[i].row) own.push_back(x[row]);
    along.assign(thin.stride, 0.0);
    thin.gather(own, along.data());
    for (std::size_t k = 0; k < thin.n; ++k) solution_[used_[i][k]] = along[k];
  }
  if (!along.empty()) K.forward(solution_.data());
  for (std::size_t k = 0; k < K.nodes(); ++k) {
    const Range& range = range_[k];
    double sum[width] = {};
    if (range.first < range.last && islands_[island_of_node_[k]].thin.empty()) {
      const Island& island = islands_[island_of_node_[k]];
      const std::size_t at = range.first - first_column_[island_of_node_[k]];
      for (std::size_t c = 0; c < range.size(); ++c) {
        const double impulse = x[island.row[at + c]];
        if (impulse == 0) continue;
        for (std::size_t i = 0; i < width; ++i) sum[i] += Z_[range.at + i * range.stride() + c] * impulse;
      }
    }
    for (std::size_t i = 0; i < width; ++i) solution_[width * k + i] += z_[width * k + i] + sum[i];
  }
  K.backward(solution_.data());
  for (std::size_t row : mechanism_.rows()) x[row] = 0;
  mechanism_.add_impulses(solution_, x);
}

// q := u_c - W x_c. With u from a product with the whole A at x, the errors of W and q from the rounding of K
// vanish at x. The next solve finds the correction.
void Reduction::Island::shift(std::span<const double> x, std::span<const double> u) {
  const std::size_t m = rows();
  if (!thin.empty()) {
    std::vector<double> own(m), product(m, 0.0);
    for (std::size_t r = 0; r < m; ++r) own[r] = x[row[r]];
    thin.add_product(own, product);
    for (std::size_t r = 0; r < m; ++r) q[r] = u[row[r]] - product[r];
    return;
  }
  for (std::size_t r = 0; r < m; ++r) {
    double sum = 0;
    for (std::size_t c = 0; c < m; ++c) sum += W[m * r + c] * x[row[c]];
    q[r] = u[row[r]] - sum;
  }
}

void Reduction::correct(std::span<const double> u, std::span<double> x) {
  mechanism_.correct(u, x, solution_);
}

}  // namespace amontons
