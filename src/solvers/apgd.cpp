// Accelerated projected gradient descent in the P metric with adaptive step and restart. Sources: Nesterov
// 1983; Mazhar, Heyn, Tasora, Negrut, "Using Nesterov's method to accelerate multibody dynamics with friction
// and contact", ACM TOG 2015; O'Donoghue, Candes 2015 (restart). A step d from y is accepted on the curvature
// d'Ad <= L d'Pd, not on objective values, which stop being comparable near rounding.
#include <algorithm>
#include <cmath>

#include "amontons/solvers/monitor.hpp"
#include "amontons/solvers/solvers.hpp"
#include "phases.hpp"

namespace amontons {

Solution apgd(const Problem& problem, const Options& options) {
  constexpr double relaxation = 0.9;    // of L after every step
  constexpr std::size_t refresh = 100;  // iterations between two evaluations of u from scratch
  const std::size_t m = problem.rows();
  Monitor monitor(options, 100000, 10000);
  const double scale = natural_map_at_zero(problem, options.law);
  std::vector<double> x(m), ux(m), y(m), uy(m), next(m), u_next(m), d(m), Ad(m), best(m);
  double r = starting_point(problem, options, x, ux, monitor);
  best = x, y = x, uy = ux;
  double L = 1, theta = 1;
  Status status;
  for (std::size_t j = 1;; ++j) {
    if (j % refresh == 0 || r <= options.tolerance) {
      // Both, or the momentum would amplify the difference of their rounding errors.
      r = evaluate(problem, options.law, x, ux, monitor) / scale;
      evaluate(problem, options.law, y, uy, monitor);
    }
    const auto stop = monitor.observe(r, objective(problem, x, ux), 1 / L);
    if (monitor.improved()) best = x;
    if (stop) {
      status = *stop;
      break;
    }
    for (;;) {  // d = Pi_K(y - P^-1 g(y) / L) - y, L doubled until it bounds the curvature along d
      double dPd = 0, dAd = 0;
      for_each_block(problem.K, [&]<class Cone>(const Cone& cone, std::size_t block, std::size_t row) {
        double g[Cone::dim];
        add_saxce_term(cone, options.law, &uy[row], g);
        for (int k = 0; k < Cone::dim; ++k) g[k] = y[row + k] - g[k] / (L * problem.P[block]);
        cone.project(g, &next[row]);
        for (int k = 0; k < Cone::dim; ++k) {
          d[row + k] = next[row + k] - y[row + k];
          dPd += problem.P[block] * d[row + k] * d[row + k];
        }
      });
      product(problem.A, d, Ad);
      ++monitor.products;
      for (std::size_t i = 0; i < m; ++i) dAd += d[i] * Ad[i];
      require_curvature(dAd, dPd);
      if (dAd <= L * dPd || !(dPd > 0)) break;
      L = std::max(2 * L, dAd / dPd);
    }
    double ascent = 0;  // <y - x+, x+ - x> > 0 in the P metric: the momentum points uphill
    for_each_block(problem.K, [&]<class Cone>(const Cone&, std::size_t block, std::size_t row) {
      for (int k = 0; k < Cone::dim; ++k)
        ascent -= problem.P[block] * d[row + k] * (next[row + k] - x[row + k]);
    });
    const double theta_next = 0.5 * theta * (std::sqrt(theta * theta + 4) - theta);
    const double beta = ascent > 0 ? 0.0 : theta * (1 - theta) / (theta * theta + theta_next);
    theta = ascent > 0 ? 1.0 : theta_next;
    L *= relaxation;
    for (std::size_t i = 0; i < m; ++i) {
      u_next[i] = uy[i] + Ad[i];
      y[i] = next[i] + beta * (next[i] - x[i]);
      uy[i] = u_next[i] + beta * (u_next[i] - ux[i]);
    }
    x.swap(next), ux.swap(u_next);
    r = natural_map(problem, options.law, x, ux) / scale;
  }
  return finish(problem, options, "apgd", std::move(best), status, monitor);
}

}  // namespace amontons
