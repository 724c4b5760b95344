// P-SPG-FB as published: A. Tasora, "Efficient simulation of contacts, friction and constraints using a
// modified spectral projected gradient method", WSCG 2013, with every parameter of the paper exposed. Values
// of the objective are compared, each trial point costs a product, and the fallback keeps the iterate with
// the smallest projected gradient at scale tau_g.
#include <algorithm>
#include <cmath>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/solvers.hpp"

namespace amontons {

namespace {

using Vector = std::vector<double>;

double dot(const Vector& a, const Vector& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// out = Pi_K(x - t g) - x
void projected_step(const SetProduct& K, const Vector& x, double t, const Vector& g, Vector& out) {
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = x[i] - t * g[i];
  project(K, out, out);
  for (std::size_t i = 0; i < x.size(); ++i) out[i] -= x[i];
}

}  // namespace

Solution spg_literal(const Problem& problem, const Options& options) {
  const SpgOptions& o = options.spg;
  const std::size_t m = problem.rows();
  Monitor monitor(options, 100000, 100000);
  const double scale = natural_map_at_zero(problem, options.law);

  Vector P(m), x(m), u(m), g(m), p(m), d(m), x_next(m), u_next(m), g_next(m), x_FB(m), trial(m);
  for_each_block(problem.K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
    for (int k = 0; k < Set::dim; ++k) P[row + k] = problem.P[block];
  });
  // g = A x + b, and under coulomb the De Saxce correction refreshed at every evaluation.
  const auto gradient = [&](const Vector& point, Vector& point_u, Vector& point_g) {
    product(problem.A, point, point_u);
    ++monitor.products;
    for (std::size_t i = 0; i < m; ++i) point_u[i] += problem.b[i];
    for_each_block(problem.K, [&](const auto& set, std::size_t, std::size_t row) {
      add_saxce_term(set, options.law, &point_u[row], &point_g[row]);
    });
  };
  // 1/2 x'Ax + x'b, the correction (g - u) of the current iterate counted as part of b
  const auto objective = [&](const Vector& point, const Vector& point_u) {
    double f = 0;
    for (std::size_t i = 0; i < m; ++i) f += point[i] * (0.5 * (point_u[i] + problem.b[i]) + g[i] - u[i]);
    return f;
  };

  const double r_start = starting_point(problem, options, x, u, monitor);
  const Vector start = x;
  gradient(x, u, g);
  x_FB = x;
  double alpha = 1, f = objective(x, u), w_best = 1e29;
  // f_{j-i} of the paper's maximum over i = 0..min(j, N_GLL): N_GLL + 1 values, those before the first -inf.
  Vector recent(o.memory + 1, -INFINITY);
  recent[0] = f;
  std::size_t backtracks = 0;
  double r_FB = r_start;  // the residual of the fallback
  bool is_fallback = false;
  Status status;
  for (std::size_t j = 0;; ++j) {
    const double r = natural_map(problem, options.law, x, u) / scale;
    if (is_fallback) r_FB = r;
    if (const auto stop = monitor.observe(r, f, alpha, backtracks)) {
      status = *stop;
      if (status == Status::converged) x_FB = x, r_FB = r;
      break;
    }
    for (std::size_t i = 0; i < m; ++i) p[i] = g[i] / P[i];
    projected_step(problem.K, x, alpha, p, d);
    double dg = dot(d, g);
    if (dg >= 0) {  // safeguard: the unpreconditioned direction
      projected_step(problem.K, x, alpha, g, d);
      dg = dot(d, g);
    }
    const double f_max = *std::max_element(recent.begin(), recent.end());
    // Under coulomb, f is a sum of differences with the correction of each iterate: with the correction of
    // the trial point -d need not be a direction of ascent. Under associated the shift is exactly zero.
    const double shift = f - objective(x, u);
    double lambda = 1, f_next = 0;
    for (backtracks = 0;; ++backtracks) {
      for (std::size_t i = 0; i < m; ++i) x_next[i] = x[i] + lambda * d[i];
      gradient(x_next, u_next, g_next);
      f_next = objective(x_next, u_next) + shift;
      if (f_next <= f_max + o.gamma * lambda * dg || backtracks == 60) break;
      const double minimum = -lambda * lambda * dg / (2 * (f_next - f - lambda * dg));
      lambda = std::clamp(std::isfinite(minimum) ? minimum : 0.0, o.sigma_min * lambda, o.sigma_max * lambda);
    }
    double sPs = 0, sy = 0, yPy = 0, w = 0;
    for (std::size_t i = 0; i < m; ++i) {
      const double s = x_next[i] - x[i], y = g_next[i] - g[i];
      sPs += P[i] * s * s, sy += s * y, yPy += y * y / P[i];
    }
    const double next = j % 2 ? sPs / sy : sy / yPy;
    alpha = std::clamp(sy > 0 ? next : o.alpha_max, o.alpha_min, o.alpha_max);
    projected_step(problem.K, x_next, o.tau_g, g_next, trial);
    for (double v : trial) w += (v / o.tau_g) * (v / o.tau_g);
    is_fallback = std::sqrt(w) <= w_best;
    if (is_fallback) w_best = std::sqrt(w), x_FB = x_next;
    x.swap(x_next), u.swap(u_next), g.swap(g_next);
    f = f_next;
    recent[(j + 1) % recent.size()] = f;
  }
  // The fallback is chosen by another measure than the residual: it must not return less than it was given.
  if (r_FB > r_start) x_FB = start;
  return finish(problem, options, "p-spg-fb-literal", std::move(x_FB), status, monitor);
}

}  // namespace amontons
