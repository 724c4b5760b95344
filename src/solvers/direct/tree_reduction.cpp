// A of an island as Y'Y + E. Y has one row per coordinate of a tree and six per free body. Row k has entries
// in the columns of those rows of the problem whose bodies lie beyond coordinate k. Sorted by the last
// coordinate that moves one of their bodies, and with coordinates numbered depth first, these columns are a
// range with few gaps. For a robot with four legs the product then costs little more than that of each leg
// alone. Rows of Y go to the kernel in sixes, with the hull of their ranges.
//
// Everything is formed again in each step: only memory is kept.
#include "solvers/direct/tree_reduction.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "solvers/direct/policy.hpp"
#include "solvers/linear/row_kernel.hpp"

namespace amontons {

// Trees and free bodies are the nodes of islands; the last node is for blocks that move nothing. A tree is
// one node, however many bodies it has: each impulse on it moves all of them.
void TreeReduction::number_nodes(const Problem& problem) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t n = trees_->coordinates();
  tree_of_.resize(n);
  tree_count_ = free_count_ = 0;
  for (std::size_t k = 0; k < n; ++k)
    tree_of_[k] = trees_->parent[k] < 0 ? static_cast<Index>(tree_count_++) : tree_of_[trees_->parent[k]];
  free_number_.assign(A.bodies.size(), -1);
  for (std::size_t i = 0; i < A.bodies.size(); ++i)
    if (trees_->place_of(static_cast<Index>(i)) < 0 && A.bodies.moves(static_cast<Index>(i)))
      free_number_[i] = static_cast<Index>(free_count_++);
}

// The node of a body; -1 for the world, for bodies that impulses do not move, and for links that are welded
// to the world.
Index TreeReduction::node_of(Index body) const {
  if (body < 0) return -1;
  if (const Index place = trees_->place_of(body); place >= 0)
    return trees_->last[place] < 0 ? -1 : tree_of_[trees_->last[place]];
  return free_number_[body] < 0 ? -1 : static_cast<Index>(tree_count_) + free_number_[body];
}

// Union-find over the nodes. Islands are numbered in the order of their first blocks. Blocks are sorted by
// island, place and number, so that the bits depend on the problem only.
bool TreeReduction::analyse(const Problem& problem, std::size_t most_rows) {
  const auto* A = std::get_if<ContactSystem>(&problem.A);
  if (!A || !A->constrained || !A->constrained->linkage) return false;
  trees_ = A->constrained->linkage.get();
  number_nodes(problem);
  leader_.resize(tree_count_ + free_count_ + 1);
  std::iota(leader_.begin(), leader_.end(), 0);
  const auto leader = [&](Index node) {
    Index i = node < 0 ? static_cast<Index>(leader_.size()) - 1 : node;
    while (leader_[i] != i) i = leader_[i] = leader_[leader_[i]];
    return i;
  };
  const auto place = [&](Index body) -> Index {
    if (body < 0) return -1;
    if (const Index i = trees_->place_of(body); i >= 0) return trees_->last[i];
    return static_cast<Index>(trees_->coordinates()) + free_number_[body];
  };
  const auto is_free = [&](Index body) { return body >= 0 && free_number_[body] >= 0; };
  blocks_.clear();
  for (const SetRun& run : problem.K.runs()) {
    std::size_t dim = 0;
    visit_kind(run.kind, [&]<class S>() { dim = S::dim; });
    for (std::size_t i = 0; i < run.count; ++i) {
      const std::size_t block = run.block + i;
      const ContactGraph::Link& link = problem.graph.links[block];
      const Index a = node_of(link.a), b = node_of(link.b);
      blocks_.push_back({block, run.row + dim * i, dim, run.kind, run.first + i, a < 0 ? b : a,
                         std::max(place(link.a), place(link.b)), is_free(link.a) || is_free(link.b)});
      if (a >= 0 && b >= 0) leader_[leader(a)] = leader(b);
    }
  }
  number_.assign(leader_.size(), -1);
  std::vector<std::size_t>&size = used_, &held = order_;
  size.clear();
  held.clear();
  for (Block& b : blocks_) {
    Index& mine = number_[leader(b.island)];
    if (mine < 0) {
      mine = static_cast<Index>(size.size());
      size.push_back(0);
      held.push_back(0);
    }
    b.island = mine;
    if (((b.kind == kind_of<Bilateral> ? held : size)[mine] += b.dim) > most_rows) return false;
  }
  count_ = size.size();
  std::sort(blocks_.begin(), blocks_.end(), [](const Block& a, const Block& b) {
    return std::tie(a.island, a.place, a.block) < std::tie(b.island, b.place, b.block);
  });
  return true;
}

// Ranges are empty between islands: add_products() clears those that an island has used.
void TreeReduction::factor(const Problem& problem) {
  if (islands_.size() < count_) islands_.resize(count_);
  held_.resize(count_);
  range_.assign(trees_->coordinates() + 6 * free_count_, Range{~std::size_t{0}, 0});
  work_ = 0;
  for (std::size_t first = 0, i = 0; i < count_; ++i) {
    std::size_t last = first;
    while (last < blocks_.size() && blocks_[last].island == static_cast<Index>(i)) ++last;
    fill_island(problem, i, first, last);
    first = last;
  }
}

// Sets, P and A of an island. Contacts form their rows here, as in Reduction; joints have stored ones. The
// part of trees in a row of Y was made with the problem (ContactSystem::renew), because P needs it, too.
void TreeReduction::fill_island(const Problem& problem, std::size_t number, std::size_t first,
                                std::size_t last) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contact_rows = problem.rows() - A.jacobian.size();
  Reduction::Island& island = islands_[number];
  island.K.clear();
  island.P.clear();
  row_.clear();
  std::size_t m = 0;
  for (std::size_t i = first; i < last; ++i) m += blocks_[i].dim;
  A_.assign(m * m, 0.0);
  stride_ = (m + lanes - 1) / lanes * lanes;
  Y_.assign(range_.size() * stride_ + group * stride_ + lanes, 0.0);
  used_.clear();
  for (std::size_t i = first; i < last; ++i) {
    const Block& b = blocks_[i];
    const bool held = b.kind == kind_of<Bilateral>;
    if (!held) {
      visit_kind(b.kind, [&]<class S>() { island.K.append(problem.K.all<S>()[b.set]); });
      island.P.push_back(problem.P[b.block]);
    }
    for (std::size_t k = 0; k < b.dim; ++k) {
      const std::size_t row = b.row + k, column = row_.size();
      const bool contact = row < contact_rows;
      A_[(m + 1) * column] = contact ? A.contact_compliance[b.block] : A.compliance[row - contact_rows];
      for (std::size_t entry = A.half.first[row]; entry < A.half.first[row + 1]; ++entry)
        set(static_cast<std::size_t>(A.half.coordinate[entry]), column, A.half.value[entry]);
      if (b.free)
        fill_free(A.bodies,
                  contact ? jacobian_row(A.contacts[b.block], ContactBasis(A.contacts[b.block]),
                                         static_cast<int>(k))
                          : A.jacobian[row - contact_rows],
                  column);
      const auto at = static_cast<std::ptrdiff_t>(row);
      row_.push_back(held ? -1 - at : at);
    }
  }
  add_products();
  eliminate(problem, held_[number], island);
}

// Cholesky's method, stopped after the rows of f. With the bilateral rows first,
//
//   A = (A_ff A_fc; A_cf A_cc),   A_ff = U'U,   Z = U^-T A_fc,   W = A_cc - Z'Z,
//
// b is one more column: y = U^-T b_f and q = b_c - Z'y. A row of the factor is complete before it leaves the
// rows below it, so that a single loop over whole rows makes U, Z and y. Redundant rows have pivots of the
// size of their compliance; a pivot below the rounding of its terms is raised to it.
//
// The upper half of A, rows and columns of f first, loses the rows of f one by one: their outer products
// leave the rows below. The products with columns of c are summed at the end, six rows at a time.
void TreeReduction::eliminate(const Problem& problem, Held& held, Reduction::Island& island) {
  const std::size_t m = row_.size();
  order_.clear();
  held.row.clear();
  island.row.clear();
  island.q.clear();
  for (std::size_t i = 0; i < m; ++i)
    if (row_[i] < 0) {
      order_.push_back(i);
      held.row.push_back(static_cast<std::size_t>(-1 - row_[i]));
    }
  for (std::size_t i = 0; i < m; ++i)
    if (row_[i] >= 0) {
      order_.push_back(i);
      island.row.push_back(static_cast<std::size_t>(row_[i]));
      island.q.push_back(problem.b[island.row.back()]);
    }
  const std::size_t f = held.row.size(), c = m - f;
  island.W.resize(c * c);
  for (std::size_t i = 0; i < c; ++i)
    for (std::size_t j = i; j < c; ++j) {
      const std::size_t a = order_[f + i], b = order_[f + j];
      island.W[c * i + j] = A_[m * std::min(a, b) + std::max(a, b)];
    }
  if (f > 0) {
    held.stride = (m + 1 + lanes - 1) / lanes * lanes;
    held.factor.assign((f + group) * held.stride + lanes, 0.0);
    for (std::size_t i = 0; i < f; ++i) {
      double* to = &held.factor[held.stride * i];
      for (std::size_t j = i; j < m; ++j) {
        const std::size_t a = order_[i], b = order_[j];
        to[j] = A_[m * std::min(a, b) + std::max(a, b)];
      }
      to[m] = problem.b[held.row[i]];
    }
    for (std::size_t k = 0; k < f; ++k) {
      double* own = &held.factor[held.stride * k];
      const std::size_t a = order_[k];
      const double pivot = std::sqrt(std::max(own[k], direct::least_compliance * A_[(m + 1) * a]));
      for (std::size_t j = k; j <= m; ++j) own[j] /= pivot;
      for (std::size_t i = k + 1; i < f; ++i) {
        const double share = own[i];
        if (share == 0) continue;
        double* to = &held.factor[held.stride * i];
        for (std::size_t j = i; j <= m; ++j) to[j] -= share * own[j];
      }
    }
    for (std::size_t k = 0; k < f; ++k) {
      const double* own = &held.factor[held.stride * k];
      for (std::size_t j = 0; j < c; ++j) island.q[j] -= own[m] * own[f + j];
    }
    for (std::size_t k = 0; k < f; k += group)
      AMONTONS_DISPATCH(add_gram, island.W.data(), c, &held.factor[held.stride * k + f], held.stride, c, -1);
    work_ += static_cast<double>(f * (f + 3 * c) * (f + c) / 6);
  }
  for (std::size_t r = 0; r < c; ++r)
    for (std::size_t k = 0; k < r; ++k) island.W[c * r + k] = island.W[c * k + r];
}

// The impulses of bilateral rows that hold exactly for those of the other rows, as in Reduction::recover():
//
// U x_f = -(y + Z x_c), from the last row up. Rows of islands that are not in x_c have their own.
void TreeReduction::recover(std::span<double> x) const {
  for (std::size_t i = 0; i < count_; ++i) {
    const Held& held = held_[i];
    const std::vector<std::size_t>& rest = islands_[i].row;
    const std::size_t f = held.row.size(), m = f + rest.size();
    for (std::size_t k = f; k-- > 0;) {
      const double* own = &held.factor[held.stride * k];
      double sum = own[m];
      for (std::size_t j = k + 1; j < f; ++j) sum += own[j] * x[held.row[j]];
      for (std::size_t j = 0; j < rest.size(); ++j) sum += own[f + j] * x[rest[j]];
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

// The first column of a coordinate begins its range; columns come in ascending order.
void TreeReduction::set(std::size_t coordinate, std::size_t column, double value) {
  Range& range = range_[coordinate];
  if (range.first > range.last) {
    range = {column, column + 1};
    used_.push_back(coordinate);
  }
  range.last = column + 1;
  Y_[coordinate * stride_ + column] = value;
}

// A free body has the block diag(1 / m, I^-1) of M^-1. Its rows of Y are
// m^-1/2 f, and R't with I^-1 = R R' by Cholesky; a body may turn about some axes only.
// Bodies of trees have no number among free ones, and are passed over.
void TreeReduction::fill_free(const Bodies& bodies, const JacobianRow& row, std::size_t column) {
  fill_free(bodies, row.body_a, row.a, column);
  fill_free(bodies, row.body_b, row.b, column);
}

void TreeReduction::fill_free(const Bodies& bodies, Index body, const std::array<double, 6>& j,
                              std::size_t column) {
  if (body < 0 || free_number_[body] < 0) return;
  const std::size_t at = trees_->coordinates() + 6 * static_cast<std::size_t>(free_number_[body]);
  const double root = std::sqrt(bodies.inverse_mass[body]);
  for (std::size_t k = 0; k < 3; ++k) set(at + k, column, root * j[k]);
  const auto& [xx, yy, zz, xy, xz, yz] = bodies.inverse_inertia[body];
  const auto over = [](double a, double pivot) { return pivot > 0 ? a / pivot : 0; };
  const double a = std::sqrt(xx), b = over(xy, a), c = over(xz, a);
  const double d = std::sqrt(std::max(0.0, yy - b * b)), e = over(yz - b * c, d);
  const double f = std::sqrt(std::max(0.0, zz - c * c - e * e));
  set(at + 3, column, a * j[3] + b * j[4] + c * j[5]);
  set(at + 4, column, d * j[4] + e * j[5]);
  set(at + 5, column, f * j[5]);
}

// The upper half of A += Y'Y, six coordinates with neighbouring ranges at a time. Coordinates that no row of
// the island reaches are left out; the others are sorted, which makes their ranges neighbours.
void TreeReduction::add_products() {
  const std::size_t m = row_.size();
  std::sort(used_.begin(), used_.end());
  for (std::size_t at = 0; at < used_.size(); at += group) {
    const std::size_t end = std::min(used_.size(), at + group);
    Range hull{~std::size_t{0}, 0};
    for (std::size_t i = at; i < end; ++i) {
      hull.first = std::min(hull.first, range_[used_[i]].first);
      hull.last = std::max(hull.last, range_[used_[i]].last);
    }
    const std::size_t size = hull.last - hull.first;
    // Consecutive coordinates lie in consecutive rows of Y; others, and a remainder, are gathered.
    const double* rows = &Y_[used_[at] * stride_ + hull.first];
    if (end - at < group || used_[end - 1] - used_[at] != group - 1) {
      six_.assign(group * stride_ + lanes, 0.0);
      for (std::size_t i = at; i < end; ++i)
        std::copy_n(&Y_[used_[i] * stride_ + hull.first], size, &six_[(i - at) * stride_]);
      rows = six_.data();
    }
    AMONTONS_DISPATCH(add_gram, &A_[(m + 1) * hull.first], m, rows, stride_, size, 1);
    work_ += static_cast<double>(size * size * group / 2);
  }
  for (const std::size_t k : used_) range_[k] = {~std::size_t{0}, 0};
}

}  // namespace amontons
