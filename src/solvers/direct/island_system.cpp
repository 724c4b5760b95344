#include "solvers/direct/island_system.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solvers/linear/row_kernel.hpp"
#include "solvers/linear/small_solve.hpp"

namespace amontons {

void IslandSystem::start(const Reduction::Island& island, std::span<const double> mobility) {
  K_ = &island.K;
  units_.make(*K_, island.q, mobility);
  q_ = island.q;
  units_.from_velocities(q_);
  const std::size_t m = island.rows();
  thin_ = island.thin;
  W_ = island.W;
  offset_.assign(1, 0);
  for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    offset_.push_back(offset_.back() + S::dim * S::dim);
    const double root = units_.root(block);
    for (std::size_t i = row; i < row + S::dim; ++i) {
      if (!thin_.empty()) {
        for (std::size_t k = 0; k < thin_.n; ++k) thin_.Y[thin_.stride * i + k] *= root;
        thin_.E[i] *= root * root;
        continue;
      }
      for (std::size_t j = 0; j < m; ++j) {
        W_[m * i + j] *= root;
        W_[m * j + i] *= root;
      }
    }
  });
  const std::size_t size = thin_.empty() ? m : thin_.n;
  stride_ = factor_stride(size);
  matrix_.assign(size * stride_, 0.0);
  columns_.resize(size * factor_columns);
  pivots_.resize(size);
  if (thin_.empty()) return;
  rows_.resize(m);
  std::iota(rows_.begin(), rows_.end(), std::size_t{0});
  inverse_.resize(offset_.back());
  C_.resize(offset_.back());
  T_.resize(thin_.terms());
}

// m^3 / 3 multiplications of a dense kernel, which does four in the time of one elsewhere, and the passes
// over rows. By rates m n^2 more form the matrix of n rows.
std::uint64_t IslandSystem::work() const {
  const std::uint64_t m = q_.size(), n = pivots_.size();
  return thin_.empty() ? m * m * (m + 90) / 12                   // not tuned: counted
                       : (m + n) * n * n / 4 + 90 * m * n / 12;  // not tuned: counted
}

void IslandSystem::product(std::span<const double> x, std::span<double> u) const {
  std::copy(q_.begin(), q_.end(), u.begin());
  if (!thin_.empty())
    thin_.add_product(x, u);
  else
    AMONTONS_DISPATCH(add_product, u.data(), x.data(), W_.data(), x.size(), x.size());
}

// Sign of det A from its factors with row pivots.
static int sign_of_factors(std::span<const double> A, std::span<const std::size_t> pivots,
                           std::size_t stride) {
  int sign = 1;
  for (std::size_t i = 0; i < pivots.size(); ++i)
    if ((pivots[i] != i) != (A[(stride + 1) * i] < 0)) sign = -sign;
  return sign;
}

// Immobile rows have R = 0 and T = 0, and z = 0.
int IslandSystem::factor(std::span<const double> R, std::span<const double> BT) {
  if (!thin_.empty()) return factor_by_rates(R, BT);
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
  return sign_of_factors(matrix_, pivots_, stride_);
}

// R is regular but for immobile rows, whose row of D is that of the unit matrix. A contact that sticks has C
// of about 1 / t, an open one of about t. The matrix weighs rows as an interior point of the primal form
// does. Its error grows near the end, where Newton's steps on faces follow.
int IslandSystem::factor_by_rates(std::span<const double> R, std::span<const double> BT) {
  int sign = 1;
  for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    constexpr std::size_t d = S::dim;
    const double *r = &R[offset_[block]], *bt = &BT[offset_[block]];
    double *inverse = &inverse_[offset_[block]], *C = &C_[offset_[block]], D[d * d];
    std::fill_n(inverse, d * d, 0.0);
    for (std::size_t i = 0; i < d; ++i) {
      for (std::size_t j = 0; j < d; ++j) D[d * i + j] = bt[d * i + j] + thin_.E[row + i] * r[d * i + j];
      if (r[(d + 1) * i] == 0) D[(d + 1) * i] += 1;
      inverse[(d + 1) * i] = 1;
    }
    sign *= solve_block(d, D, inverse, d);
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t j = 0; j < d; ++j) {
        double sum = 0;
        for (std::size_t k = 0; k < d; ++k) sum += r[d * i + k] * inverse[d * k + j];
        C[d * i + j] = sum;
      }
    AMONTONS_DISPATCH(multiply_rows, &T_[stride_ * row], C, thin_.row(row), d, stride_);
  });
  if (sign == 0) return 0;
  thin_.add_terms(rows_, T_, matrix_);
  if (!AMONTONS_DISPATCH(factor_rows, matrix_.data(), pivots_.data(), thin_.n, stride_, columns_.data()))
    return 0;
  return sign * sign_of_factors(matrix_, pivots_, stride_);
}

bool IslandSystem::solve(std::span<const double> q, std::span<double> z, int) const {
  if (!thin_.empty()) return solve_by_rates(q, z);
  if (q.data() != z.data()) std::copy(q.begin(), q.end(), z.begin());
  return AMONTONS_DISPATCH(solve_rows, matrix_.data(), pivots_.data(), z.data(), z.size(), stride_);
}

// to += M f, M block-diagonal.
static void add_blocks(const SetProduct& K, std::span<const std::size_t> offset, std::span<const double> M,
                       std::span<const double> f, std::span<double> to) {
  for_each_block(K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int i = 0; i < S::dim; ++i)
      for (int k = 0; k < S::dim; ++k) to[row + i] += M[offset[block] + S::dim * i + k] * f[row + k];
  });
}

bool IslandSystem::solve_by_rates(std::span<const double> f, std::span<double> z) const {
  static thread_local std::vector<double> h, w;
  h.assign(f.size(), 0.0);
  w.assign(stride_, 0.0);
  add_blocks(*K_, offset_, C_, f, h);
  thin_.gather(h, w.data());
  thin_.hold(w.data());
  if (!AMONTONS_DISPATCH(solve_rows, matrix_.data(), pivots_.data(), w.data(), thin_.n, stride_))
    return false;
  // h := f - Y'w.
  for (double& rate : w) rate = -rate;
  h.assign(f.begin(), f.end());
  AMONTONS_DISPATCH(add_row_products, h.data(), thin_.Y.data(), w.data(), h.size(), stride_);
  std::fill(z.begin(), z.end(), 0.0);
  add_blocks(*K_, offset_, inverse_, h, z);
  return std::all_of(z.begin(), z.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace amontons
