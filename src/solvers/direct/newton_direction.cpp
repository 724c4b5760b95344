#include "solvers/direct/newton_direction.hpp"

#include <algorithm>

#include "solvers/linear/row_kernel.hpp"
#include "solvers/linear/small_solve.hpp"
#include "solvers/second_order/block_equation.hpp"

namespace amontons {

bool NewtonDirection::solve(const Reduction::Island& island, Law law, const std::vector<double>& p,
                            double sigma, const std::vector<double>& x, const std::vector<double>& u,
                            std::vector<double>& dx) {
  linearise(island, law, p, x, u);
  if (!island.thin.empty()) return solve_by_rates(island.thin, sigma, dx);
  take_bounds(island, dx);
  const std::size_t rows = rhs_.size(), stride = factor_stride(rows);
  work_ = std::uint64_t{rows} * rows * (rows + 9) / 3;
  if (rows == 0) return true;
  fill(island, sigma);
  pivots_.resize(rows);
  columns_.resize(rows * factor_columns);
  if (!AMONTONS_DISPATCH(factor_rows, J_.data(), pivots_.data(), rows, stride, columns_.data()) ||
      !AMONTONS_DISPATCH(solve_rows, J_.data(), pivots_.data(), rhs_.data(), rows, stride))
    return false;
  const double* d = rhs_.data();
  for (std::size_t b : active_)
    for (std::size_t k = 0; k < linear_[b].dim; ++k) dx[linear_[b].row + k] = *d++;
  return true;
}

void NewtonDirection::linearise(const Reduction::Island& island, Law law, const std::vector<double>& p,
                                const std::vector<double>& x, const std::vector<double>& u) {
  linear_.resize(island.K.blocks());
  for_each_block(island.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    Linear& l = linear_[block];
    l.row = row;
    l.dim = S::dim;
    l.p = p[block];
    block_equation(set, law, l.p, &x[row], &u[row], l.F, l.G, l.H);
    l.acts = std::any_of(l.H, l.H + S::dim * S::dim, [](double h) { return h != 0; });
  });
}

// Blocks at a bound move to it. The change du that this causes, W times the moves, is known.
void NewtonDirection::take_bounds(const Reduction::Island& island, std::vector<double>& dx) {
  const std::size_t m = island.rows();
  active_.clear();
  runs_.clear();
  du_.assign(m, 0.0);
  std::size_t rows = 0;
  for (std::size_t b = 0; b < linear_.size(); ++b) {
    Linear& l = linear_[b];
    if (l.acts) {
      active_.push_back(b);
      if (!runs_.empty() && runs_.back().end == l.row)
        runs_.back().end += l.dim;
      else
        runs_.push_back({l.row, l.row + l.dim});
      l.column = rows;
      rows += l.dim;
      continue;
    }
    for (std::size_t k = 0; k < l.dim; ++k) {
      const double d = dx[l.row + k] = -l.F[k];
      if (d == 0) continue;
      const double* W = &island.W[m * (l.row + k)];
      for (std::size_t j = 0; j < m; ++j) du_[j] += d * W[j];
    }
  }
  rhs_.resize(rows);
}

// Matrix and right-hand side of the active blocks. Most rows of H have one nonzero.
void NewtonDirection::fill(const Reduction::Island& island, double sigma) {
  const std::size_t m = island.rows(), stride = factor_stride(rhs_.size());
  J_.resize(rhs_.size() * stride);
  std::size_t at = 0;
  for (std::size_t b : active_) {
    const Linear& l = linear_[b];
    for (std::size_t i = 0; i < l.dim; ++i, ++at) {
      const double* H = &l.H[l.dim * i];
      double* to = &J_[stride * at];
      rhs_[at] = -l.F[i];
      bool begun = false;
      for (std::size_t k = 0; k < l.dim; ++k) {
        rhs_[at] -= H[k] * du_[l.row + k];
        if (H[k] == 0) continue;
        const double* W = &island.W[m * (l.row + k)];
        begun ? add_active<true>(W, H[k], to) : add_active<false>(W, H[k], to);
        begun = true;
      }
      std::fill(to + (begun ? rhs_.size() : 0), to + stride, 0.0);
      double* J = to + l.column;
      for (std::size_t j = 0; j < l.dim; ++j) J[j] += l.G[l.dim * i + j] + H[j] * sigma * l.p;
    }
  }
}

// J = h w or J += h w, where w is a row of W restricted to the columns of the active blocks.
template <bool adds>
void NewtonDirection::add_active(const double* w, double h, double* J) const {
  for (const Run& run : runs_) {
    const std::size_t size = run.end - run.first;
    for (std::size_t j = 0; j < size; ++j) J[j] = (adds ? J[j] : 0) + h * w[run.first + j];
    J += size;
  }
}

// r and S of an active block, and its rows of S Y.
//
// A block without compliance that sticks has D = sigma, and S is 1 / (sigma p). Then r and S Y'z are larger
// than dx by the same factor, and their difference has lost these digits. The next step works on what is
// left, so that nothing is lost in the end. But a term of 1e-13, as the form by rows allows, would leave no
// digit at all: here it stays at its first value.
bool NewtonDirection::reduce_block(const ThinMatrix& W, double sigma, const Linear& l) {
  const std::size_t d = l.dim, width = d + 1, at = rows_.size();
  for (std::size_t i = 0; i < d; ++i) rows_.push_back(l.row + i);
  double D[36], X[42];
  for (std::size_t i = 0; i < d; ++i) {
    X[width * i] = -l.F[i];
    for (std::size_t j = 0; j < d; ++j) {
      const double h = l.H[d * i + j];
      D[d * i + j] = l.G[d * i + j] + h * (W.E[l.row + j] + sigma * l.p);
      X[width * i + 1 + j] = h;
    }
  }
  if (solve_block(d, D, X, width) == 0) return false;
  double* S = &S_[6 * at];
  for (std::size_t i = 0; i < d; ++i) {
    r_[at + i] = X[width * i];
    for (std::size_t j = 0; j < d; ++j) S[d * i + j] = X[width * i + 1 + j];
  }
  AMONTONS_DISPATCH(multiply_rows, &T_[W.stride * at], S, W.row(l.row), d, W.stride);
  return true;
}

// The matrix has one row per coordinate, so that its size does not grow with the contacts. It is not
// symmetric where contacts slide, and is factored with row pivots, like the matrix by rows.
bool NewtonDirection::solve_by_rates(const ThinMatrix& W, double sigma, std::vector<double>& dx) {
  const std::size_t n = W.n, stride = W.stride;
  rows_.clear();
  r_.resize(W.rows());
  S_.resize(6 * W.rows());
  T_.resize(W.terms());
  for (const Linear& l : linear_) {
    if (!l.acts)
      for (std::size_t k = 0; k < l.dim; ++k) dx[l.row + k] = -l.F[k];
    else if (!reduce_block(W, sigma, l))
      return false;
  }
  const std::size_t active = rows_.size();
  for (std::size_t i = 0; i < active; ++i) dx[rows_[i]] = r_[i];
  work_ = std::uint64_t{active} * n * n + std::uint64_t{n} * n * n / 3;
  if (active == 0) return true;
  z_.assign(stride, 0.0);
  W.gather(dx, z_.data());
  W.hold(z_.data());
  W.add_terms(rows_, T_, J_);
  if (!W.Q.empty()) work_ += std::uint64_t{n} * n * n;
  pivots_.resize(n);
  columns_.resize(n * factor_columns);
  if (!AMONTONS_DISPATCH(factor_rows, J_.data(), pivots_.data(), n, stride, columns_.data()) ||
      !AMONTONS_DISPATCH(solve_rows, J_.data(), pivots_.data(), z_.data(), n, stride))
    return false;
  // The rows of S Y are not symmetric in S: dx takes S times Y'z, block by block.
  du_.assign(W.rows(), 0.0);
  AMONTONS_DISPATCH(add_row_products, du_.data(), W.Y.data(), z_.data(), W.rows(), stride);
  std::size_t at = 0;
  for (const Linear& l : linear_) {
    if (!l.acts) continue;
    const double* S = &S_[6 * at];
    for (std::size_t i = 0; i < l.dim; ++i)
      for (std::size_t j = 0; j < l.dim; ++j) dx[l.row + i] -= S[l.dim * i + j] * du_[l.row + j];
    at += l.dim;
  }
  return true;
}

}  // namespace amontons
