#include "solvers/direct/newton_direction.hpp"

#include <algorithm>

#include "solvers/direct/block_equation.hpp"
#include "solvers/linear/row_kernel.hpp"

namespace amontons {

bool NewtonDirection::solve(const Reduction::Island& island, Law law, const std::vector<double>& p,
                            double sigma, const std::vector<double>& x, const std::vector<double>& u,
                            std::vector<double>& dx) {
  linearise(island, law, p, x, u);
  take_bounds(island, dx);
  const std::size_t rows = this->rows(), stride = factor_stride(rows);
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
  J_.assign(rhs_.size() * stride, 0.0);
  std::size_t at = 0;
  for (std::size_t b : active_) {
    const Linear& l = linear_[b];
    for (std::size_t i = 0; i < l.dim; ++i, ++at) {
      const double* H = &l.H[l.dim * i];
      rhs_[at] = -l.F[i];
      for (std::size_t k = 0; k < l.dim; ++k) {
        rhs_[at] -= H[k] * du_[l.row + k];
        if (H[k] != 0) add_active(&island.W[m * (l.row + k)], H[k], &J_[stride * at]);
      }
      double* J = &J_[stride * at + l.column];
      for (std::size_t j = 0; j < l.dim; ++j) J[j] += l.G[l.dim * i + j] + H[j] * sigma * l.p;
    }
  }
}

// J += h w, where w is a row of W restricted to the columns of the active blocks.
void NewtonDirection::add_active(const double* w, double h, double* J) const {
  for (const Run& run : runs_) {
    const std::size_t size = run.end - run.first;
    for (std::size_t j = 0; j < size; ++j) J[j] += h * w[run.first + j];
    J += size;
  }
}

}  // namespace amontons
