// W is formed on the way up the elimination tree. The six rows of Y of a node are complete once its children
// have passed on their parts. They contribute to Y'S Y at once, while they are in the cache. A solve with K
// per column would also need the way down; this one does not.
#include "solvers/direct/reduction.hpp"

#include <algorithm>

#include "solvers/linear/row_kernel.hpp"

namespace amontons {

namespace {

// Whether an island has more rows than `most_rows` beside its bilateral ones. Bilateral rows join bodies as
// other rows do: these islands are those of find_islands(), which needs the mechanisms for them. The analysis
// would number all bodies of a pile, order its elimination, sort its blocks, and come to the same answer.
// Problems of few rows skip the test: they have no large island.
bool has_large_island(const Problem& problem, std::size_t most_rows) {
  if (problem.rows() <= most_rows) return false;
  static thread_local std::vector<std::size_t> rows;  // kept: a step allocates nothing
  const Islands& islands = problem.graph.islands;
  rows.assign(islands.count, 0);
  for (const SetRun& run : problem.K.runs()) {
    if (run.kind == kind_of<Bilateral>) continue;
    visit_kind(run.kind, [&]<class S>() {
      for (std::size_t i = 0; i < run.count; ++i) rows[islands.of_block[run.block + i]] += S::dim;
    });
  }
  return std::any_of(rows.begin(), rows.end(), [most_rows](std::size_t own) { return own > most_rows; });
}

}  // namespace

// Piles are recognised by their links alone, which the problem has already. The analysis of so many bodies
// costs as much as many products.
bool Reduction::analyse(const Problem& problem, std::size_t most_rows) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || A->constrained || has_large_island(problem, most_rows)) return false;
  mechanism_.analyse(problem);
  return mechanism_.takes_little() && find_islands(problem, most_rows);
}

bool Reduction::find_islands(const Problem& problem, std::size_t most_rows) {
  const auto first = [this](const ContactGraph::Link& link) {
    const Index a = mechanism_.place(link.a), b = mechanism_.place(link.b);
    return a < 0 || b < 0 ? std::max(a, b) : std::min(a, b);
  };
  count_ = sort_into_islands(problem, false, first, rest_);
  first_column_.assign(count_ + 1, 0);
  for (const IslandBlock& r : rest_) first_column_[r.island + 1] += r.dim;
  for (std::size_t i = 0; i < count_; ++i) {
    if (first_column_[i + 1] > most_rows) return false;
    first_column_[i + 1] += first_column_[i];
  }
  return true;
}

bool Reduction::factor(const Problem& problem) {
  if (!mechanism_.factor(problem)) return false;
  mechanism_.right_side(problem.b, y_);
  mechanism_.K().forward(y_.data());
  fill_islands(problem);
  place_columns(problem);
  start_columns(problem);
  sweep();
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

// Sets, P, rows, q = b_c and W = E_c, in the order of the columns.
void Reduction::fill_islands(const Problem& problem) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contact_rows = problem.rows() - A.jacobian.size();
  if (islands_.size() < count_) islands_.resize(count_);
  for (std::size_t i = 0; i < count_; ++i) {
    Island& island = islands_[i];
    const std::size_t m = first_column_[i + 1] - first_column_[i];
    island.clear();
    island.W.assign(m * m, 0.0);
  }
  for (const IslandBlock& r : rest_) {
    Island& island = islands_[r.island];
    const std::size_t m = first_column_[r.island + 1] - first_column_[r.island];
    for (std::size_t k = 0; k < r.dim; ++k)
      island.W[(m + 1) * (island.rows() + k)] =
          r.row < contact_rows ? A.contact_compliance[r.block] : A.compliance[r.row + k - contact_rows];
    island.add(problem, r);
  }
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
  std::size_t column = 0;
  for (const IslandBlock& r : rest_) {
    const ContactGraph::Link& link = problem.graph.links[r.block];
    for (const Index body : {link.a, link.b}) {
      const Index place = mechanism_.place(body);
      if (place < 0) continue;
      Range& range = range_[place];
      range.first = std::min(range.first, column);
      range.last = std::max(range.last, column + r.dim);
      island_of_node_[place] = r.island;
    }
    column += r.dim;
  }
  std::size_t size = 0;
  for (std::size_t k = 0; k < K.nodes(); ++k) {
    Range& range = range_[k];
    if (range.first >= range.last) continue;
    range.at = size;
    size += width * range.stride();
    if (const Index p = K.parent(k); p >= 0) {
      range_[p].first = std::min(range_[p].first, range.first);
      range_[p].last = std::max(range_[p].last, range.last);
      island_of_node_[p] = island_of_node_[k];
    }
  }
  // The padding of the last row of a child may exceed that of its parent.
  Y_.assign(size + lanes, 0.0);
}

// Writes D_c' at the nodes of the bodies, where the columns start.
void Reduction::start_columns(const Problem& problem) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contact_rows = problem.rows() - A.jacobian.size();
  std::size_t column = 0;
  for (const IslandBlock& r : rest_) {
    if (r.row < contact_rows) {
      const ContactGeometry& c = A.contacts[r.block];
      const ContactBasis basis(c);
      for (std::size_t k = 0; k < r.dim; ++k)
        start_column(A.bodies, jacobian_row(c, basis, static_cast<int>(k)), column++);
    } else {
      for (std::size_t k = 0; k < r.dim; ++k)
        start_column(A.bodies, A.jacobian[r.row + k - contact_rows], column++);
    }
  }
}

// For a row between two bodies of one mechanism, both parts are in one column, at two nodes.
void Reduction::start_column(const Bodies& bodies, const JacobianRow& D, std::size_t column) {
  const auto start = [&](Index body, std::array<double, 6> d) {
    const Index place = mechanism_.place(body);
    if (place < 0) return;
    keep_moving(bodies, static_cast<std::size_t>(body), d);
    const Range& range = range_[place];
    for (std::size_t k = 0; k < width; ++k) Y_[range.at + k * range.stride() + column - range.first] = d[k];
  };
  start(D.body_a, D.a);
  start(D.body_b, D.b);
}

// Y = L^-1 (D_c', 0) from the leaves to the roots; W and q are formed on the way.
void Reduction::sweep() {
  const QuasidefiniteFactor& K = mechanism_.K();
  for (std::size_t k = 0; k < K.nodes(); ++k) {
    const Range& range = range_[k];
    if (range.first >= range.last) continue;
    double* Y = &Y_[range.at];
    K.forward_node(k, Y, range.stride());
    for (std::size_t slot = K.first_slot(k); slot < K.last_slot(k); ++slot) {
      const Range& above = range_[K.above(slot)];
      K.forward_update(slot, K.sign(k), Y, range.stride(), &Y_[above.at + range.first - above.first],
                       above.stride());
    }
    add_products(k, range);
  }
  for (std::size_t i = 0; i < count_; ++i) {
    Island& island = islands_[i];
    const std::size_t m = island.rows();
    for (std::size_t r = 0; r < m; ++r)
      for (std::size_t c = 0; c < r; ++c) island.W[m * r + c] = island.W[m * c + r];
  }
}

// W += s Y'Y (upper half) and q += s Y'y for one node.
void Reduction::add_products(std::size_t node, const Range& range) {
  const std::size_t first = first_column_[island_of_node_[node]], size = range.size();
  Island& island = islands_[island_of_node_[node]];
  const std::size_t m = island.rows(), at = range.first - first;
  const int s = mechanism_.K().sign(node);
  double y[width];
  for (std::size_t k = 0; k < width; ++k) y[k] = s * y_[width * node + k];
  AMONTONS_DISPATCH(add_six_rows, &island.q[at], y, &Y_[range.at], range.stride(), size);
  AMONTONS_DISPATCH(add_gram, &island.W[(m + 1) * at], m, &Y_[range.at], range.stride(), size, s);
}

// L^-1 (D_c'x_c, -b_f) = Y x_c + y, then up the tree.
void Reduction::recover(std::span<double> x) {
  const QuasidefiniteFactor& K = mechanism_.K();
  z_ = y_;
  for (std::size_t k = 0; k < K.nodes(); ++k) {
    const Range& range = range_[k];
    if (range.first >= range.last) continue;
    const Island& island = islands_[island_of_node_[k]];
    const std::size_t at = range.first - first_column_[island_of_node_[k]];
    double sum[width] = {};
    for (std::size_t c = 0; c < range.size(); ++c) {
      const double impulse = x[island.row[at + c]];
      if (impulse == 0) continue;
      for (std::size_t i = 0; i < width; ++i) sum[i] += Y_[range.at + i * range.stride() + c] * impulse;
    }
    for (std::size_t i = 0; i < width; ++i) z_[width * k + i] += sum[i];
  }
  K.backward(z_.data());
  for (std::size_t row : mechanism_.rows()) x[row] = 0;
  mechanism_.add_impulses(z_, x);
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

void Reduction::correct(std::span<const double> u, std::span<double> x) { mechanism_.correct(u, x, z_); }

}  // namespace amontons
