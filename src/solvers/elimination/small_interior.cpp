// Newton's equation on the central path, with the dual iterate w and u = W x + q:
//
//     w = u + s(w) e_n,   x o w = mu e     (x in K, w in its dual; o the Jordan product of the sets),
//
// where s is the De Saxce term, taken at w: its tangents are those of u. In the limit mu = 0 that is the law.
// s has a kink where w has no tangent, at every contact that sticks; sqrt(s^2 + epsilon^2) with epsilon a
// share of mu has none, and leaves the limit as it is. With its gradient g in the tangents, B = I - e_n g'
// and the barriers' dx = R z, dw = T (rho - z) (sets/barrier.hpp) a step is
//
//     (B T + W R) z = w - u - s e_n + B T rho,
//
// in units in which each block's part of W is of order one, as in second_order/interior_point.cpp.
#include "solvers/elimination/small_interior.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/problem/residual.hpp"
#include "solvers/linear/row_kernel.hpp"

namespace amontons {

namespace {

// Of the way to the boundary, as in interior_point.cpp.
constexpr double fraction = 0.99;
// Of mu: what a step aims at where the predictor is so short that it tells nothing, which brings the iterate
// back to the middle.
constexpr double centring_target = 0.8, short_predictor = 0.1;
// Steps this short lead nowhere.
constexpr double shortest_step = 1e-6;

}  // namespace

void SmallInterior::start(const Reduction::Island& island, Law law, std::span<const double> mobility,
                          Way way) {
  island_ = &island;
  law_ = law;
  way_ = way;
  const std::size_t m = island.rows();
  for (std::vector<double>* v : {&F_, &x_, &u_, &rho_, &z_}) v->assign(m, 0.0);
  pivots_.resize(m);
  K_.resize(m * m);
  beta_ = 0;
  for_each_block(island.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int k = 0; k < S::dim; ++k)
      beta_ = std::max(beta_, std::abs(island.q[row + k]) / std::sqrt(mobility[block]));
  });
  unit_.clear();
  for (double p : mobility) unit_.push_back(beta_ / std::sqrt(p));
  barriers_.make(island.K, unit_);
  degree_ = 0;
  offset_.assign(1, 0);
  each([&]<class S>(const S&, auto& barrier, std::size_t, std::size_t) {
    const double nothing[S::dim] = {};
    barrier.start(nothing);
    barrier.push(1, 1);
    degree_ += barrier.degree();
    offset_.push_back(offset_.back() + S::dim * S::dim);
  });
  R_.resize(offset_.back());
  T_.resize(offset_.back());
}

void SmallInterior::x(std::vector<double>& out) {
  each([&]<class S>(const S&, auto& barrier, std::size_t block, std::size_t row) {
    barrier.primal(&out[row]);
    for (int k = 0; k < S::dim; ++k) out[row + k] *= unit_[block];
  });
}

// F = w - u - s e_n, and of each block R and B T.
void SmallInterior::linearise() {
  const std::size_t m = x_.size();
  x(x_);
  u_ = island_->q;
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < m; ++j) u_[j] += x_[i] * island_->W[m * i + j];
  const double mu = gap(0);
  each([&]<class S>(const S& set, auto& barrier, std::size_t block, std::size_t row) {
    constexpr int d = S::dim;
    double *R = &R_[offset_[block]], *T = &T_[offset_[block]], w[d];
    barrier.factor(R);
    barrier.dual_factor(T);
    barrier.dual(w);
    const double unit = unit_[block] / (beta_ * beta_);
    for (int k = 0; k < d; ++k) F_[row + k] = w[k] - unit * u_[row + k];
    if constexpr (S::frictional) {
      if (law_ != Law::coulomb) return;
      const double s = set.saxce(w), rounded = std::hypot(s, way_.rounding * std::min(mu, 1.0));
      double g[d];
      set.saxce_gradient(w, g);
      F_[row] -= rounded;
      for (int j = 0; j < d && s > 0; ++j)
        for (int k = 1; k < d; ++k) T[j] -= s / rounded * g[k] * T[d * k + j];
    }
  });
}

// B T + W R in the units of the blocks, and its factors. What does not move has R = 0, and z = 0.
bool SmallInterior::assemble() {
  const std::size_t m = x_.size();
  each([&]<class S>(const S&, auto&, std::size_t block, std::size_t row) {
    const double* R = &R_[offset_[block]];
    for (std::size_t i = 0; i < m; ++i)
      for (int j = 0; j < S::dim; ++j) {
        double sum = 0;
        for (int k = 0; k < S::dim; ++k) sum += island_->W[m * i + row + k] * R[S::dim * k + j];
        K_[m * i + row + j] = unit_[block] / (beta_ * beta_) * sum;
      }
  });
  each([&]<class S>(const S&, auto&, std::size_t block, std::size_t row) {
    const double *R = &R_[offset_[block]], *T = &T_[offset_[block]];
    for (int i = 0; i < S::dim; ++i) {
      for (std::size_t j = 0; j < m; ++j) K_[m * (row + i) + j] *= unit_[block];
      for (int j = 0; j < S::dim; ++j) K_[m * (row + i) + row + j] += T[S::dim * i + j];
      if (R[(S::dim + 1) * i] == 0) K_[(m + 1) * (row + i)] += 1;
    }
  });
  return AMONTONS_DISPATCH(factor_rows, K_.data(), pivots_.data(), m);
}

// The direction to `target`, left in the barriers.
bool SmallInterior::solve(double target, bool corrector) {
  each([&]<class S>(const S&, auto& barrier, std::size_t block, std::size_t row) {
    const double* T = &T_[offset_[block]];
    barrier.target(target, corrector, &rho_[row]);
    for (int i = 0; i < S::dim; ++i) {
      z_[row + i] = F_[row + i];
      for (int k = 0; k < S::dim; ++k) z_[row + i] += T[S::dim * i + k] * rho_[row + k];
    }
  });
  if (!AMONTONS_DISPATCH(solve_rows, K_.data(), pivots_.data(), z_.data(), z_.size())) return false;
  each([&]<class S>(const S&, auto& barrier, std::size_t, std::size_t row) {
    barrier.recover(target, &z_[row]);
  });
  return true;
}

double SmallInterior::longest_step() {
  double t = INFINITY;
  each(
      [&](const auto&, auto& barrier, std::size_t, std::size_t) { t = std::min(t, barrier.longest_step()); });
  return t;
}

double SmallInterior::gap(double t) {
  double sum = 0;
  each([&](const auto&, auto& barrier, std::size_t, std::size_t) { sum += barrier.gap(t); });
  return sum / std::max(1.0, degree_);
}

// Mehrotra's predictor and corrector, by one factorisation.
bool SmallInterior::step() {
  linearise();
  if (!assemble() || !solve(0, false)) return false;
  const double mu = gap(0), affine = std::min(1.0, longest_step());
  const bool tells = affine > short_predictor;
  const double ratio = mu > 0 ? std::clamp(gap(affine) / mu, 0.0, 1.0) : 0.0;
  const double aim = tells ? std::max(ratio * ratio * ratio, way_.least_target) : centring_target;
  if (!solve(aim * mu, tells)) return false;
  const double t = std::min(1.0, fraction * longest_step());
  if (!(t > shortest_step)) return false;
  each([&](const auto&, auto& barrier, std::size_t, std::size_t) { barrier.move(t); });
  return true;
}

}  // namespace amontons
