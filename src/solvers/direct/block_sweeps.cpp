#include "solvers/direct/block_sweeps.hpp"

#include <algorithm>
#include <cmath>

#include "solvers/direct/policy.hpp"
#include "solvers/linear/row_kernel.hpp"

namespace amontons {

// The bound is Gershgorin's: the largest sum of a row's absolute entries is at least the largest eigenvalue.
// With q at least as large, 1/2 q |d|^2 + <g, d> bounds the change of 1/2 x'W x + b'x from above. A
// projection of x - g / q then lowers it under the associated law.
//
// Under coulomb the De Saxce term is renewed with every projection. Nothing is proven there, and the natural
// map decides whether the x of the sweeps is kept. The mean of the diagonal is in the maximum because the
// rows of a block that impulses do not move have no sum.
void BlockSweeps::start(const Reduction::Island& island, Law law, const std::vector<double>& p) {
  island_ = &island;
  law_ = law;
  work_ = 0;
  const ThinMatrix& thin = island.thin;
  const std::size_t m = island.rows();
  if (!thin.empty() && !thin.Q.empty()) {
    YQ_.assign(m * thin.stride, 0.0);
    for (std::size_t i = 0; i < m; ++i)
      AMONTONS_DISPATCH(add_product, &YQ_[thin.stride * i], thin.row(i), thin.Q.data(), thin.n, thin.stride);
    work_ += std::uint64_t{m} * thin.n * thin.n;
  }
  const auto entry = [&](std::size_t i, std::size_t j) {
    if (thin.empty()) return island.W[m * i + j];
    const double* row = thin.Q.empty() ? thin.row(i) : &YQ_[thin.stride * i];
    double sum = i == j ? thin.E[i] : 0;
    for (std::size_t k = 0; k < thin.n; ++k) sum += row[k] * thin.row(j)[k];
    return sum;
  };
  diagonal_.clear();
  bound_.clear();
  for_each_block(island.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    double bound = p[block];
    for (int i = 0; i < S::dim; ++i) {
      double sum = 0;
      for (int j = 0; j < S::dim; ++j) {
        diagonal_.push_back(entry(row + i, row + j));
        sum += std::abs(diagonal_.back());
      }
      bound = std::max(bound, sum);
    }
    bound_.push_back(bound);
  });
}

void BlockSweeps::begin_at(const std::vector<double>& x) {
  const ThinMatrix& thin = island_->thin;
  if (!thin.empty()) {
    z_.assign(thin.stride, 0.0);
    thin.gather(x, z_.data());
    thin.hold(z_.data());
    work_ += std::uint64_t{x.size()} * thin.n;
    return;
  }
  u_ = island_->q;
  AMONTONS_DISPATCH(add_product, u_.data(), x.data(), island_->W.data(), x.size(), x.size());
  work_ += std::uint64_t{x.size()} * x.size();
}

// A block that stays at a bound is charged, too: its projections take about as long as its columns.
void BlockSweeps::sweep(std::vector<double>& x) {
  const ThinMatrix& thin = island_->thin;
  const double* W = diagonal_.data();
  for_each_block(island_->K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    constexpr int d = S::dim;
    double u[d], next[d], dx[d] = {};
    if (thin.empty()) {
      std::copy_n(&u_[row], d, u);
    } else {
      for (int i = 0; i < d; ++i) u[i] = island_->q[row + i] + thin.E[row + i] * x[row + i];
      AMONTONS_DISPATCH(add_row_products, u, thin.row(row), z_.data(), d, thin.stride);
      work_ += d * thin.n;
    }
    bool moved = false;
    for (int round = 0; round < (d == 1 ? 1 : direct::policy.projections); ++round) {
      double g[d];
      add_de_saxce_term(set, law_, u, g);
      for (int i = 0; i < d; ++i) g[i] = x[row + i] - g[i] / bound_[block];
      set.project(g, next);
      for (int i = 0; i < d; ++i) {
        const double change = next[i] - x[row + i];
        for (int j = 0; j < d; ++j) u[j] += W[d * i + j] * change;
        dx[i] += change;
        moved = moved || change != 0;
      }
      std::copy_n(next, d, &x[row]);
    }
    W += d * d;
    work_ += d * (thin.empty() ? x.size() : thin.n);
    if (!moved) return;
    if (thin.empty())
      AMONTONS_DISPATCH(add_product, u_.data(), dx, &island_->W[x.size() * row], d, x.size());
    else
      AMONTONS_DISPATCH(add_product, z_.data(), dx, thin.Q.empty() ? thin.row(row) : &YQ_[thin.stride * row],
                        d, thin.stride);
  });
}

}  // namespace amontons
