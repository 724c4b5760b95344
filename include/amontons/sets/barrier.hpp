#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "amontons/sets/second_order_cone.hpp"

// The barrier of a block in a primal-dual interior point (solvers/second_order/interior_point.cpp). Each set
// has a Barrier with the iterate of one block, in units in which the block's mean of diag(A) is one:
//
//   Barrier(set, unit)         x in units of `unit` (N s)
//   degree()                   the number of complementarity products, <x, u> = degree mu on the central path
//   start_factor(R)            R of the first system, a unit proximal term in place of W^2
//   start(x)                   sets x to the solution of that system and u = -x, which may lie outside
//   worst(x, u)                lowers both arguments to the smallest eigenvalues of x and u
//   push(x, u)                 adds these multiples of e to x and u, so that they lie inside
//   factor(R)                  the scaling W of the iterate; R = W^-1, so that R R' is the inverse Hessian
//   dual_factor(T)             T = R^-T of that iterate, from which du = T (rho - z)
//   target(mu, corrector, rho) of W dx + W^-1 du = rho: rho = lambda \ (mu e - lambda o lambda - second)
//   recover(mu, z)             dx = R z, du = W (rho - z) from the solution z = W dx of the system
//   longest_step()             the largest t for which x + t dx and u + t du stay inside
//   gap(t)                     <x + t dx, u + t du>
//   move(t)                    makes the step
//   primal(x), dual(u)         the iterate, in the same units
//
// `corrector` adds Mehrotra's second-order term of the last recovered step.
namespace amontons {

// A free row: u = 0, W^2 is a small proximal term.
struct BilateralBarrier {
  // W^2 of a free row (relative to the block's mean of diag(A)): keeps the linear system regular.
  static constexpr double proximal = 1e-9;
  double x = 0, dx = 0;

  template <class Set>
  BilateralBarrier(const Set&, double) {}
  double degree() const { return 0; }
  void start_factor(double* R) const { R[0] = 1 / std::sqrt(proximal); }
  void start(const double* solution) { x = solution[0]; }
  void worst(double&, double&) const {}
  void push(double, double) {}
  void factor(double* R) const { start_factor(R); }
  void dual_factor(double* T) const { T[0] = std::sqrt(proximal); }
  void target(double, bool, double* rho) const { rho[0] = 0; }
  void recover(double, const double* z) { dx = z[0] / std::sqrt(proximal); }
  double longest_step() const { return std::numeric_limits<double>::infinity(); }
  double gap(double) const { return 0; }
  void move(double t) { x += t * dx; }
  void primal(double* out) const { out[0] = x; }
  void dual(double* out) const { out[0] = 0; }
};

// A cone { x : D x in L } with L the second-order cone and D diagonal: x^ = D x, u^ = D^-1 u. Degenerate rows
// (with a friction coefficient of zero) are left out: they stay zero.
template <std::size_t n>
struct ConeBarrier {
  using V = second_order::V<n>;
  V D;
  std::array<bool, n> live;
  V x{}, u{}, dx{}, du{}, rho{};
  second_order::Scaling<n> W;

  // The cone with x_0 >= |(x_k / mu_k)|, scaled by the largest mu, so that tangential rows keep their size.
  static constexpr double flat = 1e-9;  // limit of mu_k, below which a row is left out
  explicit ConeBarrier(const std::array<double, n - 1>& mu) {
    double largest = 0;
    for (double m : mu) largest = std::max(largest, m);
    const bool half_line = !(largest > flat);
    D[0] = half_line ? 1 : largest;
    live[0] = true;
    for (std::size_t k = 1; k < n; ++k) {
      live[k] = mu[k - 1] > flat;
      D[k] = live[k] ? largest / mu[k - 1] : 1;
    }
  }

  double degree() const { return 1; }
  void start_factor(double* R) const {
    std::fill(R, R + n * n, 0.0);
    for (std::size_t k = 0; k < n; ++k)
      if (live[k]) R[(n + 1) * k] = 1 / D[k];
  }
  void start(const double* solution) {
    for (std::size_t k = 0; k < n; ++k) {
      x[k] = live[k] ? D[k] * solution[k] : 0;
      u[k] = -x[k];
    }
  }
  void worst(double& low_x, double& low_u) const {
    low_x = std::min(low_x, x[0] - second_order::tail(x));
    low_u = std::min(low_u, u[0] - second_order::tail(u));
  }
  void push(double more_x, double more_u) {
    x[0] += more_x;
    u[0] += more_u;
  }
  void factor(double* R) {
    W = second_order::Scaling<n>(u, x);
    for (std::size_t k = 0; k < n; ++k) {
      V unit{};
      unit[k] = 1;
      const V column = W.inverse_times(unit);
      for (std::size_t i = 0; i < n; ++i) R[n * i + k] = live[i] && live[k] ? column[i] / D[i] : 0;
    }
  }
  void dual_factor(double* T) const {
    for (std::size_t k = 0; k < n; ++k) {
      V unit{};
      unit[k] = 1;
      const V column = W.times(unit);
      for (std::size_t i = 0; i < n; ++i) T[n * i + k] = live[i] && live[k] ? column[i] * D[i] : 0;
    }
  }
  void aim(double mu, bool corrector) {
    V c = second_order::jordan(W.lambda, W.lambda);
    for (double& v : c) v = -v;
    c[0] += mu;
    if (corrector) {
      const V second = second_order::jordan(W.inverse_times(du), W.times(dx));
      for (std::size_t k = 0; k < n; ++k) c[k] -= second[k];
    }
    rho = second_order::jordan_divide(W.lambda, c);
  }
  void target(double mu, bool corrector, double* out) {
    aim(mu, corrector);
    std::copy(rho.begin(), rho.end(), out);
  }
  void recover(double, const double* solution) {
    V z, rest;
    for (std::size_t k = 0; k < n; ++k) {
      z[k] = live[k] ? solution[k] : 0;
      rest[k] = rho[k] - z[k];
    }
    dx = W.inverse_times(z);
    du = W.times(rest);
  }
  double longest_step() const {
    return std::min(second_order::step_to_boundary(x, dx), second_order::step_to_boundary(u, du));
  }
  double gap(double t) const {
    double sum = 0;
    for (std::size_t k = 0; k < n; ++k) sum += (x[k] + t * dx[k]) * (u[k] + t * du[k]);
    return sum;
  }
  void move(double t) {
    for (std::size_t k = 0; k < n; ++k) {
      x[k] += t * dx[k];
      u[k] += t * du[k];
    }
  }
  void primal(double* out) const {
    for (std::size_t k = 0; k < n; ++k) out[k] = x[k] / D[k];
  }
  void dual(double* out, double t = 0) const {
    for (std::size_t k = 0; k < n; ++k) out[k] = (u[k] + t * du[k]) * D[k];
  }
};

}  // namespace amontons
