// Y of an island has the coordinates that its rows reach. Blocks are sorted by the last coordinate that moves
// one of their bodies, so that rows beside each other reach the same ones.
//
// Everything is formed again in each step: only memory is kept.
#include "solvers/direct/tree_reduction.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "solvers/direct/policy.hpp"
#include "solvers/linear/row_kernel.hpp"
#include "solvers/linear/small_roots.hpp"
#include "solvers/second_order/policy.hpp"

namespace amontons {

bool TreeReduction::analyse(const Problem& problem, std::size_t most_rows) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || !A->constrained || !A->constrained->linkage) return false;
  trees_ = A->constrained->linkage.get();
  free_number_.assign(A->bodies.size(), -1);
  free_count_ = 0;
  for (std::size_t i = 0; i < A->bodies.size(); ++i)
    if (trees_->place_of(static_cast<Index>(i)) < 0 && A->bodies.moves(static_cast<Index>(i)))
      free_number_[i] = static_cast<Index>(free_count_++);
  const auto place = [&](Index body) -> Index {
    if (body < 0) return -1;
    if (const Index i = trees_->place_of(body); i >= 0) return trees_->last[i];
    return static_cast<Index>(trees_->coordinates()) + free_number_[body];
  };
  const auto last = [&](const ContactGraph::Link& link) { return std::max(place(link.a), place(link.b)); };
  count_ = sort_into_islands(problem, true, last, blocks_);
  return all_small(problem, most_rows);
}

// Whether no island has more bilateral rows, nor a larger matrix in the form that W takes.
//
// The matrix that is factored has the smaller of rows and coordinates. Rows beyond the coordinates add to a
// step in proportion, m n^2 in place of m^3 / 3, as contacts do in a method that works on accelerations. A
// cube of 26 parts has 126 coordinates and 900 rows of contacts. Islands of free bodies alone count rows, as
// they do without trees: beside a robot, too, a pile has a sparse matrix in iterations.
//
// All coordinates of a tree count, also those that no row of the island reaches. find_used() would be exact,
// but needs the rows of Y. A tree is counted at its first coordinate, a free body after all trees.
bool TreeReduction::all_small(const Problem& problem, std::size_t most_rows) {
  struct Size {
    std::size_t held = 0, others = 0, coordinates = 0;
    bool has_tree = false;
  };
  static thread_local std::vector<Size> size;
  static thread_local std::vector<std::size_t> root, left;  // left: coordinates that are not counted yet
  const std::size_t n = trees_->coordinates();
  size.assign(count_, {});
  root.resize(n);
  left.assign(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    root[k] = trees_->parent[k] < 0 ? k : root[static_cast<std::size_t>(trees_->parent[k])];
    ++left[root[k]];
  }
  left.resize(n + free_count_, 6);
  for (const IslandBlock& b : blocks_) {
    Size& island = size[static_cast<std::size_t>(b.island)];
    (b.bilateral() ? island.held : island.others) += b.dim;
    const ContactGraph::Link& link = problem.graph.links[b.block];
    for (const Index body : {link.a, link.b}) {
      if (body < 0) continue;
      const Index place = trees_->place_of(body);
      const Index last = place < 0 ? -1 : trees_->last[place];
      island.has_tree = island.has_tree || last >= 0;
      if (last >= 0)
        island.coordinates += std::exchange(left[root[static_cast<std::size_t>(last)]], 0);
      else if (is_free(body))
        island.coordinates += std::exchange(left[n + static_cast<std::size_t>(free_number_[body])], 0);
    }
  }
  return std::all_of(size.begin(), size.end(), [most_rows](const Size& s) {
    return std::max(s.held, s.has_tree ? std::min(s.others, s.coordinates) : s.others) <= most_rows;
  });
}

void TreeReduction::factor(const Problem& problem) {
  if (islands_.size() < count_) islands_.resize(count_);
  held_.resize(count_);
  compact_.assign(trees_->coordinates() + 6 * free_count_, -1);
  work_ = 0;
  for (std::size_t first = 0, i = 0; i < count_; ++i) {
    std::size_t last = first;
    while (last < blocks_.size() && blocks_[last].island == static_cast<Index>(i)) ++last;
    fill_island(problem, i, first, last);
    first = last;
  }
}

// Whether m rows over n coordinates take fewer multiplications in factors, which is so from m = 1.6 n.
//
// By rows there are W and the factors of Newton's matrix of m rows. By rates there are a matrix of n rows, to
// which each row of the problem adds n^2 products, and its factors. W is made once, the rest in each Newton
// step, of which most solves take two.
static bool is_thin(std::size_t m, std::size_t n) {
  const std::size_t by_rates = 2 * (m * n * n + n * n * n / 3);     // not tuned: counted
  const std::size_t by_rows = m * m * n / 2 + 2 * (m * m * m / 3);  // not tuned: counted
  return n > 0 && by_rates < by_rows;
}

// Sets, P and rows of an island, then W.
void TreeReduction::fill_island(const Problem& problem, std::size_t number, std::size_t first,
                                std::size_t last) {
  Reduction::Island& island = islands_[number];
  Held& held = held_[number];
  island.clear();
  held.row.clear();
  row_.clear();
  for (std::size_t i = first; i < last; ++i) {
    const IslandBlock& b = blocks_[i];
    const std::vector<std::size_t>& rows = b.bilateral() ? held.row : island.row;
    for (std::size_t k = 0; k < b.dim; ++k) {
      const auto place = static_cast<std::ptrdiff_t>(rows.size() + k);
      row_.push_back(b.bilateral() ? -1 - place : place);
    }
    if (b.bilateral())
      for (std::size_t k = 0; k < b.dim; ++k) held.row.push_back(b.row + k);
    else
      island.add(problem, b);
  }
  find_used(problem, first, last);
  fill_matrix(problem, held, island, first, last);
  for (const std::size_t k : used_) compact_[k] = -1;
}

// The coordinates that rows of the island reach, ascending, and their places among them. Those of its bodies
// would be too many: a row along a coordinate reaches none of the others that a joint or a chain puts beyond.
void TreeReduction::find_used(const Problem& problem, std::size_t first, std::size_t last) {
  const auto& A = std::get<ContactSystem>(problem.A);
  used_.clear();
  const auto use = [&](std::size_t k) {
    if (compact_[k] >= 0) return;
    compact_[k] = 0;
    used_.push_back(k);
  };
  for (std::size_t i = first; i < last; ++i) {
    const IslandBlock& b = blocks_[i];
    for (std::size_t entry = A.half.first[b.row]; entry < A.half.first[b.row + b.dim]; ++entry)
      use(static_cast<std::size_t>(A.half.coordinate[entry]));
    const ContactGraph::Link& link = problem.graph.links[b.block];
    for (const Index body : {link.a, link.b})
      if (is_free(body))
        for (std::size_t k = 0; k < 6; ++k) use(first_of_free(body) + k);
  }
  std::sort(used_.begin(), used_.end());
  for (std::size_t i = 0; i < used_.size(); ++i) compact_[used_[i]] = static_cast<Index>(i);
}

// Calls put(coordinate, value) for the nonzeros of each row of D M^-1/2, after begin(column, E). Contacts
// form their rows here, as in Reduction; joints have stored ones. The part of trees was made with the problem
// (ContactSystem::renew), because P needs it, too.
template <class Begin, class Put>
void TreeReduction::visit_rows(const Problem& problem, std::size_t first, std::size_t last,
                               const Begin& begin, const Put& put) const {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contact_rows = problem.rows() - A.jacobian.size();
  std::size_t column = 0;
  for (std::size_t i = first; i < last; ++i) {
    const IslandBlock& b = blocks_[i];
    const ContactGraph::Link& link = problem.graph.links[b.block];
    const bool free = is_free(link.a) || is_free(link.b);
    for (std::size_t k = 0; k < b.dim; ++k, ++column) {
      const std::size_t row = b.row + k;
      const bool contact = row < contact_rows;
      begin(column, contact ? A.contact_compliance[b.block] : A.compliance[row - contact_rows]);
      for (std::size_t entry = A.half.first[row]; entry < A.half.first[row + 1]; ++entry)
        put(static_cast<std::size_t>(A.half.coordinate[entry]), A.half.value[entry]);
      if (free)
        put_free(A.bodies,
                 contact ? jacobian_row(A.contacts[b.block], ContactBasis(A.contacts[b.block]),
                                        static_cast<int>(k))
                         : A.jacobian[row - contact_rows],
                 put);
    }
  }
}

// W in the form that takes fewer multiplications. Bilateral rows would be active in every Newton step. They
// are taken out once instead: with A_ff = Y_f'Y_f + E_f = U'U and y = U^-T b_f
//
//   by rows    Z = U^-T Y_f'Y_c,   W = Y_c'Y_c + E_c - Z'Z,                       q = b_c - Z'y,
//   in factors V = U^-T Y_f',      W = Y_c'Q Y_c + E_c,       Q = 1 - V'V,        q = b_c - Y_c'V'y.
void TreeReduction::fill_matrix(const Problem& problem, Held& held, Reduction::Island& island,
                                std::size_t first, std::size_t last) {
  const std::size_t n = used_.size(), f = held.row.size(), c = island.row.size();
  const bool thin = is_thin(c, n);
  held.stride = (f + (thin ? n : c) + 1 + lanes - 1) / lanes * lanes;
  held.factor.assign((f + std::max(thin ? 0 : c, group)) * held.stride + lanes, 0.0);
  island.thin.n = 0;
  island.W.resize(thin ? 0 : c * c);
  if (thin)
    fill_thin(problem, held, island.thin, c, first, last);
  else
    fill_dense(problem, held, island.W, c, first, last);
  for (std::size_t i = 0; i < f; ++i)
    held.factor[held.stride * i + f + (thin ? n : c)] = problem.b[held.row[i]];
  factor_held(held, thin ? n : c);
  take_held(held, island);
}

// Y by coordinates, with the columns of f before those of c. Six coordinates at a time make the upper half of
// A = Y'Y + E. Its first rows are A_ff and A_fc, and the others W.
// W leaves before the elimination, because rows of zeros take its place (take_held()). Sums along rows of Y
// took 1.4 times the instructions of a solve (measured on 851bb0b8). These products pass over the columns of
// other legs or arms.
void TreeReduction::fill_dense(const Problem& problem, Held& held, std::vector<double>& W, std::size_t c,
                               std::size_t first, std::size_t last) {
  const std::size_t f = held.row.size(), m = f + c, stride = held.stride;
  Y_.assign((used_.size() + group) * stride, 0.0);
  double* A = held.factor.data();
  std::size_t at = 0;
  visit_rows(
      problem, first, last,
      [&](std::size_t column, double compliance) {
        const std::ptrdiff_t place = row_[column];
        at = place < 0 ? static_cast<std::size_t>(-1 - place) : f + static_cast<std::size_t>(place);
        A[(stride + 1) * at] = compliance;
      },
      [&at, stride, Y = Y_.data(), place = compact_.data()](std::size_t coordinate, double value) {
        Y[stride * static_cast<std::size_t>(place[coordinate]) + at] = value;
      });
  for (std::size_t k = 0; k < used_.size(); k += group)
    AMONTONS_DISPATCH(add_gram, A, stride, &Y_[stride * k], stride, m, 1);
  work_ += static_cast<double>(m * m * used_.size() / 2);
  for (std::size_t i = 0; i < c; ++i) std::copy_n(A + stride * (f + i) + f, c, &W[c * i]);
  std::fill_n(A + f * stride, group * stride, 0.0);
}

// Y by rows of the problem, as all products with W in factors run along the coordinates of one row. U takes
// the rows of Y_f with it, and turns them into V.
void TreeReduction::fill_thin(const Problem& problem, Held& held, ThinMatrix& W, std::size_t c,
                              std::size_t first, std::size_t last) {
  const std::size_t n = used_.size(), f = held.row.size();
  W.resize(n, c);
  const std::size_t stride = W.stride;
  std::vector<double>&Yf = Y_, &E = work_row_;
  Yf.assign(f * stride, 0.0);
  E.assign(f, 0.0);
  double* to = nullptr;
  visit_rows(
      problem, first, last,
      [&](std::size_t column, double compliance) {
        const std::ptrdiff_t place = row_[column];
        const auto at = static_cast<std::size_t>(place < 0 ? -1 - place : place);
        to = place < 0 ? &Yf[stride * at] : &W.Y[stride * at];
        (place < 0 ? E : W.E)[at] = compliance;
      },
      [&to, place = compact_.data()](std::size_t coordinate, double value) {
        to[place[coordinate]] = value;
      });
  for (std::size_t i = 0; i < f; ++i) {
    double *own = &held.factor[held.stride * i], *Yi = &Yf[stride * i];
    AMONTONS_DISPATCH(add_row_products, own + i, Yi, Yi, f - i, stride);
    own[i] += E[i];
    std::copy_n(Yi, n, own + f);
  }
}

// W and q, or Q and q, from U, Z or V, and y. Both forms have the same rows: U, then Z or V, then y. Their
// products are those of six rows at a time, and rows of zeros follow the last one.
void TreeReduction::take_held(const Held& held, Reduction::Island& island) {
  ThinMatrix& W = island.thin;
  const bool thin = !W.empty();
  const std::size_t f = held.row.size();
  const std::size_t width = thin ? W.n : island.rows(), stride = thin ? W.stride : width;
  std::vector<double>&matrix = thin ? W.Q : island.W, &t = work_row_;
  if (thin && f > 0) {
    matrix.assign(width * stride, 0.0);
    for (std::size_t k = 0; k < width; ++k) matrix[(stride + 1) * k] = 1;
  }
  for (std::size_t k = 0; k < f; k += group)
    AMONTONS_DISPATCH(add_gram, matrix.data(), stride, &held.factor[held.stride * k + f], held.stride, width,
                      -1);
  if (!matrix.empty())
    for (std::size_t i = 0; i < width; ++i)
      for (std::size_t k = 0; k < i; ++k) matrix[stride * i + k] = matrix[stride * k + i];
  if (f == 0) return;
  t.assign(stride, 0.0);
  for (std::size_t k = 0; k < f; ++k) {
    const double* own = &held.factor[held.stride * k];
    for (std::size_t j = 0; j < width; ++j) t[j] -= own[f + width] * own[f + j];
  }
  if (thin)
    AMONTONS_DISPATCH(add_row_products, island.q.data(), W.Y.data(), t.data(), W.rows(), stride);
  else
    for (std::size_t j = 0; j < width; ++j) island.q[j] += t[j];
}

// A row of the factor is complete before it leaves the rows below it, so that a single loop over whole rows
// makes U and all columns beside it. Redundant rows have pivots of the size of their compliance; a pivot
// below the rounding of its terms is raised to it.
void TreeReduction::factor_held(Held& held, std::size_t width) {
  const std::size_t f = held.row.size(), m = f + width;
  pivot_.resize(f);
  for (std::size_t k = 0; k < f; ++k)
    pivot_[k] = second_order::policy.rounding * held.factor[(held.stride + 1) * k];
  for (std::size_t k = 0; k < f; ++k) {
    double* own = &held.factor[held.stride * k];
    const double pivot = std::sqrt(std::max(own[k], pivot_[k]));
    for (std::size_t j = k; j <= m; ++j) own[j] /= pivot;
    for (std::size_t i = k + 1; i < f; ++i) {
      const double share = own[i];
      if (share == 0) continue;
      double* to = &held.factor[held.stride * i];
      for (std::size_t j = i; j <= m; ++j) to[j] -= share * own[j];
    }
  }
  work_ += static_cast<double>(f * (f + 3 * width) * (f + width) / 6);
}

// The impulses of bilateral rows that hold exactly for those of the other rows, as in Reduction::recover():
//
// U x_f = -(y + Z x_c), from the last row up, with Z x_c = V Y_c x_c where W is thin.
void TreeReduction::recover(std::span<double> x) {
  for (std::size_t i = 0; i < count_; ++i) {
    const Held& held = held_[i];
    if (held.row.empty()) continue;
    const ThinMatrix& thin = islands_[i].thin;
    std::vector<double>& rest = work_row_;
    rest.clear();
    for (const std::size_t row : islands_[i].row) rest.push_back(x[row]);
    if (!thin.empty()) {
      Y_.assign(thin.stride, 0.0);
      thin.gather(rest, Y_.data());
      rest.assign(Y_.begin(), Y_.begin() + static_cast<std::ptrdiff_t>(thin.n));
    }
    const std::size_t f = held.row.size(), m = f + rest.size();
    for (std::size_t k = f; k-- > 0;) {
      const double* own = &held.factor[held.stride * k];
      double sum = own[m];
      for (std::size_t j = k + 1; j < f; ++j) sum += own[j] * x[held.row[j]];
      for (std::size_t j = 0; j < rest.size(); ++j) sum += own[f + j] * rest[j];
      x[held.row[k]] = -sum / own[k];
    }
  }
}

// x_f -= A_ff^-1 u_f with u from a product with the whole A: removes the rounding of the factors.
void TreeReduction::correct(std::span<const double> u, std::span<double> x) {
  for (std::size_t i = 0; i < count_; ++i) {
    const Held& held = held_[i];
    const std::size_t f = held.row.size();
    std::vector<double>& z = work_row_;
    z.resize(f);
    for (std::size_t k = 0; k < f; ++k) z[k] = u[held.row[k]];
    for (std::size_t k = 0; k < f; ++k) {
      const double* own = &held.factor[held.stride * k];
      z[k] /= own[k];
      for (std::size_t j = k + 1; j < f; ++j) z[j] -= own[j] * z[k];
    }
    for (std::size_t k = f; k-- > 0;) {
      const double* own = &held.factor[held.stride * k];
      for (std::size_t j = k + 1; j < f; ++j) z[k] -= own[j] * z[j];
      z[k] /= own[k];
      x[held.row[k]] -= z[k];
    }
  }
}

// A free body has the block diag(1 / m, I^-1) of M^-1, and its rows of Y are j C (small_roots.hpp). Bodies of
// trees have no number among free ones, and are passed over.
template <class Put>
void TreeReduction::put_free(const Bodies& bodies, const JacobianRow& row, const Put& put) const {
  put_free(bodies, row.body_a, row.a, put);
  put_free(bodies, row.body_b, row.b, put);
}

template <class Put>
void TreeReduction::put_free(const Bodies& bodies, Index body, const std::array<double, 6>& j,
                             const Put& put) const {
  if (!is_free(body)) return;
  const std::size_t at = first_of_free(body);
  double own[6];
  times_root(j, std::sqrt(bodies.inverse_mass[body]), semidefinite_root(bodies.inverse_inertia[body]), own);
  for (std::size_t k = 0; k < 6; ++k) put(at + k, own[k]);
}

}  // namespace amontons
