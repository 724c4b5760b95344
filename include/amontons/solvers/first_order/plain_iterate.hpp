#pragma once
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/first_order/iterate.hpp"
#include "amontons/solvers/first_order/metric.hpp"

namespace amontons {

// An Iterate (iterate.hpp) for any operator with product(): the plain twin of ContactIterate and its test
// oracle. Block by block, with the projection and the natural map that the sets themselves provide.
//
// Three buffers of x rotate: one holds the current x, one the best, and one is free for the next x. The best
// iterate is kept by swapping indices and never by copying. If the current x is the best, two buffers are
// free.
template <class Op>
class PlainIterate {
 public:
  PlainIterate(const Op& A, const Problem& problem, Law law)
      : A_(A), problem_(problem), law_(law), u_(problem.rows()), d_(u_), q_(u_) {
    x_.fill(u_);
  }

  // x = Pi_K(x0). An empty x0 means zeros, which are projected too: 0 need not lie in an interval.
  double start(std::span<const double> x0) {
    std::fill(x_[now_].begin(), x_[now_].end(), 0.0);
    std::copy(x0.begin(), x0.end(), x_[now_].begin());
    project(problem_.K, x_[now_], x_[now_]);
    return refresh();
  }

  // u = A x + b from scratch, without the rounding that updates accumulate.
  double refresh() {
    velocity(x_[now_], u_);
    return natural_map_now();
  }

  // d = Pi_K(x - alpha P^-1 g) - x with <d, g> and <d, P d>.
  Direction direction(double alpha) {
    Direction sums{0, 0};
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      // P is one number per block, so that the projection in the P metric is the Euclidean one of the block.
      // Sums are formed per block and then added.
      double g[S::dim], trial[S::dim], dg = 0, dd = 0;
      const double *x = &x_[now_][row], p = problem_.P[block];
      double* d = &d_[row];
      add_de_saxce_term(set, law_, &u_[row], g);
      for (int k = 0; k < S::dim; ++k) trial[k] = x[k] - alpha * g[k] / p;
      set.project(trial, d);
      for (int k = 0; k < S::dim; ++k) {
        d[k] -= x[k];
        dg += d[k] * g[k];
        dd += d[k] * d[k];
      }
      sums.dg += dg;
      sums.dPd += p * dd;
    });
    return sums;
  }

  // <d, A d>; the one product of the iteration.
  double curvature() {
    A_.product(d_, q_);
    double sum = 0;
    for (std::size_t i = 0; i < d_.size(); ++i) sum += d_[i] * q_[i];
    return sum;
  }

  // x += lambda d, u += lambda A d, and the sums of the next step and of the residual: <s, y>, <y, P^-1 y>
  // and the squared natural map at the new x.
  Update update(double lambda) {
    Update sums{0, 0, 0};
    std::vector<double>& next = x_[free_buffer()];
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      // y = g+ - g in the gradients of the law. Under coulomb y includes the change of the De Saxce term;
      // without it the spectral step would be that of another function. Both g come from u before and after,
      // in one sweep.
      double g[S::dim], g_next[S::dim], sy = 0, yy = 0;
      add_de_saxce_term(set, law_, &u_[row], g);
      for (int k = 0; k < S::dim; ++k) {
        next[row + k] = x_[now_][row + k] + lambda * d_[row + k];
        u_[row + k] += lambda * q_[row + k];
      }
      add_de_saxce_term(set, law_, &u_[row], g_next);
      for (int k = 0; k < S::dim; ++k) {
        const double y = g_next[k] - g[k];
        sy += lambda * d_[row + k] * y;
        yy += y * y;
      }
      sums.sy += sy;
      sums.yPy += yy / problem_.P[block];
      sums.residual_squared += natural_map_squared(set, problem_.P[block], &next[row], g_next);
    });
    now_ = free_buffer();
    return sums;
  }

  void start_momentum() {
    metrics_ = block_metrics(problem_);
    y_ = x_[now_];
    u_y_ = u_;
  }

  // d = Pi_K(y - alpha P^-1 g) - y with <d, P d> and <d, P (y - x)>. g is that of y, with the De Saxce term
  // of x.
  MomentumDirection momentum_direction(double alpha) {
    MomentumDirection sums{0, 0};
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double g[S::dim], dPd = 0, dPm = 0;
      const double *y = &y_[row], *x = &x_[now_][row];
      double* d = &d_[row];
      const BlockMetric& P = metrics_[block];
      add_de_saxce_term(set, law_, &u_[row], g);
      for (int k = 0; k < S::dim; ++k) g[k] = y[k] - alpha * (g[k] + (u_y_[row + k] - u_[row + k])) / P[k];
      project_in(P, set, g, d);
      for (int k = 0; k < S::dim; ++k) {
        d[k] -= y[k];
        dPd += P[k] * d[k] * d[k];
        dPm += P[k] * d[k] * (y[k] - x[k]);
      }
      sums.dPd += dPd;
      sums.dPm += dPm;
    });
    return sums;
  }

  // x+ = y + d, y = x+ + beta (x+ - x), after curvature(). x and u hold the last iterate until the new one is
  // formed. u is then overwritten in place, and x goes to the free buffer.
  double accelerate(double beta) {
    const int target = free_buffer();
    const std::vector<double>& x = x_[now_];
    std::vector<double>& next = x_[target];
    // A y+ + b follows without a product, because A y + b is affine in y: with q = A d
    //  u+ = u_y + q,   u_y+ = u+ + beta (u+ - u).
    for (std::size_t i = 0; i < d_.size(); ++i) {
      const double u_next = u_y_[i] + q_[i];
      next[i] = y_[i] + d_[i];
      y_[i] = next[i] + beta * (next[i] - x[i]);
      u_y_[i] = u_next + beta * (u_next - u_[i]);
      u_[i] = u_next;
    }
    now_ = target;
    return natural_map_now();
  }

  // y and u_y are refreshed with x and u: their difference is the momentum, which would amplify their
  // rounding.
  double refresh_momentum() {
    velocity(y_, u_y_);
    return refresh();
  }

  void keep_best() { best_ = now_; }
  void extract(std::span<double> x) const { std::copy(x_[now_].begin(), x_[now_].end(), x.begin()); }
  void extract_best(std::span<double> x) const { std::copy(x_[best_].begin(), x_[best_].end(), x.begin()); }
  // 1/2 x'Ax + b'x = 1/2 x'(u + b), as A x = u - b.
  double objective() const {
    double sum = 0;
    for (std::size_t i = 0; i < u_.size(); ++i) sum += 0.5 * x_[now_][i] * (u_[i] + problem_.b[i]);
    return sum;
  }

 private:
  // u = A x + b, one product.
  void velocity(const std::vector<double>& x, std::vector<double>& u) const {
    A_.product(x, u);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += problem_.b[i];
  }
  // the squared natural map at x
  double natural_map_now() const {
    double sum = 0;
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double g[S::dim];
      add_de_saxce_term(set, law_, &u_[row], g);
      sum += natural_map_squared(set, problem_.P[block], &x_[now_][row], g);
    });
    return sum;
  }
  // A buffer that may be overwritten: it holds neither the current x nor the best.
  int free_buffer() const { return best_ == now_ ? (now_ + 1) % 3 : 3 - now_ - best_; }

  // Held by reference: the problem outlives the solve.
  const Op& A_;
  const Problem& problem_;
  Law law_;
  // At x: u = A x + b. Step: d, q = A d. Extrapolated point: y, u_y = A y + b.
  std::vector<double> u_, d_, q_, y_, u_y_;
  std::array<std::vector<double>, 3> x_;
  std::vector<BlockMetric> metrics_;
  int now_ = 0, best_ = 0;
};

}  // namespace amontons
