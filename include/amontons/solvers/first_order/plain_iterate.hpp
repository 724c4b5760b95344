#pragma once
#include <array>
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/first_order/iterate.hpp"

namespace amontons {

// An Iterate (iterate.hpp) for any operator with product(): the plain twin of ContactIterate and its test
// oracle.
//
// Three buffers of x rotate so that the best iterate is kept by swapping indices, never by copying.
template <class Op>
class PlainIterate {
 public:
  PlainIterate(const Op& A, const Problem& problem, Law law)
      : A_(A), problem_(problem), law_(law), u_(problem.rows()), d_(u_), q_(u_) {
    x_.fill(u_);
  }

  // x = Pi_K(x0) (0 when x0 is empty), u = A x + b; returns the squared natural map.
  double start(std::span<const double> x0) {
    if (x0.empty())
      std::fill(x_[now_].begin(), x_[now_].end(), 0.0);
    else
      std::copy(x0.begin(), x0.end(), x_[now_].begin());
    project(problem_.K, x_[now_], x_[now_]);
    return refresh();
  }

  // u = A x + b from scratch, without the rounding that updates accumulate.
  double refresh() {
    A_.product(x_[now_], u_);
    for (std::size_t i = 0; i < u_.size(); ++i) u_[i] += problem_.b[i];
    return natural_map_now();
  }

  // d = Pi_K(x - alpha P^-1 g) - x.
  Direction direction(double alpha) {
    Direction sums{0, 0};
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double g[S::dim], trial[S::dim], dg = 0, dd = 0;
      const double *x = &x_[now_][row], p = problem_.P[block];
      double* d = &d_[row];
      add_saxce_term(set, law_, &u_[row], g);
      for (int k = 0; k < S::dim; ++k) trial[k] = x[k] - alpha * g[k] / p;
      set.project(trial, d);
      for (int k = 0; k < S::dim; ++k) d[k] -= x[k], dg += d[k] * g[k], dd += d[k] * d[k];
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

  // x += lambda d, u += lambda A d, and the sums of the next step and of the residual.
  Update update(double lambda) {
    Update sums{0, 0, 0};
    std::vector<double>& next = x_[3 - now_ - best_other()];
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double g[S::dim], g_next[S::dim], sy = 0, yy = 0;
      add_saxce_term(set, law_, &u_[row], g);
      for (int k = 0; k < S::dim; ++k) {
        next[row + k] = x_[now_][row + k] + lambda * d_[row + k];
        u_[row + k] += lambda * q_[row + k];
      }
      add_saxce_term(set, law_, &u_[row], g_next);
      for (int k = 0; k < S::dim; ++k) {
        const double y = g_next[k] - g[k];
        sy += lambda * d_[row + k] * y;
        yy += y * y;
      }
      sums.sy += sy;
      sums.yPy += yy / problem_.P[block];
      sums.residual_squared += natural_map_squared(set, problem_.P[block], &next[row], g_next);
    });
    now_ = 3 - now_ - best_other();
    return sums;
  }

  void start_momentum() { y_ = x_[now_], u_y_ = u_; }

  // d = Pi_K(y - alpha P^-1 g(y)) - y
  MomentumDirection momentum_direction(double alpha) {
    MomentumDirection sums{0, 0};
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double g[S::dim], dd = 0, dm = 0;
      const double *y = &y_[row], *x = &x_[now_][row], p = problem_.P[block];
      double* d = &d_[row];
      add_saxce_term(set, law_, &u_y_[row], g);
      for (int k = 0; k < S::dim; ++k) g[k] = y[k] - alpha * g[k] / p;
      set.project(g, d);
      for (int k = 0; k < S::dim; ++k) d[k] -= y[k], dd += d[k] * d[k], dm += d[k] * (y[k] - x[k]);
      sums.dPd += p * dd;
      sums.dPm += p * dm;
    });
    return sums;
  }

  // x+ = y + d, y = x+ + beta (x+ - x), after curvature().
  double accelerate(double beta) {
    const int target = 3 - now_ - best_other();
    const std::vector<double>& x = x_[now_];
    std::vector<double>& next = x_[target];
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

  double refresh_momentum() {
    A_.product(y_, u_y_);
    for (std::size_t i = 0; i < u_y_.size(); ++i) u_y_[i] += problem_.b[i];
    return refresh();
  }

  void keep_best() { best_ = now_; }
  void extract(std::span<double> x) const { std::copy(x_[now_].begin(), x_[now_].end(), x.begin()); }
  void extract_best(std::span<double> x) const { std::copy(x_[best_].begin(), x_[best_].end(), x.begin()); }
  double objective() const {
    double sum = 0;
    for (std::size_t i = 0; i < u_.size(); ++i) sum += 0.5 * x_[now_][i] * (u_[i] + problem_.b[i]);
    return sum;
  }

 private:
  double natural_map_now() const {
    double sum = 0;
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double g[S::dim];
      add_saxce_term(set, law_, &u_[row], g);
      sum += natural_map_squared(set, problem_.P[block], &x_[now_][row], g);
    });
    return sum;
  }
  // A buffer other than the current one that must not be written: the best, or any when they coincide.
  int best_other() const { return best_ != now_ ? best_ : (now_ + 1) % 3; }

  const Op& A_;
  const Problem& problem_;
  Law law_;
  std::vector<double> u_, d_, q_, y_, u_y_;
  std::array<std::vector<double>, 3> x_;
  int now_ = 0, best_ = 0;
};

}  // namespace amontons
