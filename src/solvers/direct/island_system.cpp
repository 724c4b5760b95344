#include "solvers/direct/island_system.hpp"

#include <algorithm>

#include "solvers/linear/row_kernel.hpp"

namespace amontons {

void IslandSystem::start(const Reduction::Island& island, std::span<const double> mobility) {
  K_ = &island.K;
  units_.make(*K_, island.q, mobility);
  q_ = island.q;
  units_.from_velocities(q_);
  const std::size_t m = island.rows();
  if (island.thin.empty())
    W_ = island.W;
  else
    island.thin.fill(W_);
  stride_ = factor_stride(m);
  matrix_.assign(m * stride_, 0.0);
  columns_.resize(m * factor_columns);
  pivots_.resize(m);
  offset_.assign(1, 0);
  for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    offset_.push_back(offset_.back() + S::dim * S::dim);
    for (std::size_t i = row; i < row + S::dim; ++i)
      for (std::size_t j = 0; j < m; ++j) {
        W_[m * i + j] *= units_.root(block);
        W_[m * j + i] *= units_.root(block);
      }
  });
}

void IslandSystem::product(std::span<const double> x, std::span<double> u) const {
  std::copy(q_.begin(), q_.end(), u.begin());
  AMONTONS_DISPATCH(add_product, u.data(), x.data(), W_.data(), x.size(), x.size());
}

// Immobile rows have R = 0 and T = 0, and z = 0.
int IslandSystem::factor(std::span<const double> R, std::span<const double> BT) {
  const std::size_t m = q_.size();
  for (std::size_t i = 0; i < m; ++i) {
    const double* W = &W_[m * i];
    double* to = &matrix_[stride_ * i];
    for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      const double* r = &R[offset_[block]];
      for (int j = 0; j < S::dim; ++j) {
        double sum = 0;
        for (int k = 0; k < S::dim; ++k) sum += W[row + k] * r[S::dim * k + j];
        to[row + j] = sum;
      }
    });
  }
  for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int i = 0; i < S::dim; ++i) {
      double* to = &matrix_[stride_ * (row + i) + row];
      for (int j = 0; j < S::dim; ++j) to[j] += BT[offset_[block] + S::dim * i + j];
      if (R[offset_[block] + (S::dim + 1) * i] == 0) to[i] += 1;
    }
  });
  if (!AMONTONS_DISPATCH(factor_rows, matrix_.data(), pivots_.data(), m, stride_, columns_.data())) return 0;
  int sign = 1;
  for (std::size_t i = 0; i < m; ++i)
    if ((pivots_[i] != i) != (matrix_[(stride_ + 1) * i] < 0)) sign = -sign;
  return sign;
}

bool IslandSystem::solve(std::span<const double> q, std::span<double> z, int) const {
  if (q.data() != z.data()) std::copy(q.begin(), q.end(), z.begin());
  return AMONTONS_DISPATCH(solve_rows, matrix_.data(), pivots_.data(), z.data(), z.size(), stride_);
}

}  // namespace amontons
