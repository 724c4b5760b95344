// Accelerated projected gradient descent in the P metric with adaptive step and restart. Sources: Nesterov
// 1983; Mazhar, Heyn, Tasora, Negrut, "Using Nesterov's method to accelerate multibody dynamics with friction
// and contact", ACM TOG 2015; O'Donoghue, Candes 2015 (restart). A step d from y is accepted on the curvature
// d'Ad <= L d'Pd, not on objective values, which stop being comparable near rounding.
#include <algorithm>
#include <cmath>

#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/plain_iterate.hpp"
#include "amontons/solvers/solvers.hpp"

namespace amontons {

namespace {

constexpr double relaxation = 0.95;          // of L after every step
constexpr std::size_t refresh_period = 100;  // iterations between two evaluations of u from scratch

template <class Iterate>
Solution run(const Problem& problem, const Options& options, Iterate iterate) {
  Monitor monitor(options, 100000, 10000);
  const double scale = natural_map_at_zero(problem, options.law);
  std::vector<double> x(problem.rows()), u(problem.rows());
  starting_point(problem, options, x, u, monitor);
  double r = std::sqrt(iterate.start(x)) / scale;
  ++monitor.products;
  iterate.start_momentum();
  double L = 1, theta = 1;
  Status status;
  for (std::size_t j = 0, since_refresh = 0;; ++j) {
    if (since_refresh >= refresh_period || (r <= options.tolerance && since_refresh > 0)) {
      // Both x and y, or the momentum would amplify the difference of their rounding errors.
      r = std::sqrt(iterate.refresh_momentum()) / scale;
      monitor.products += 2;
      since_refresh = 0;
    }
    // The objective costs a pass over memory: only for those who look at it.
    const bool watched = options.history || options.callback;
    const auto stop = monitor.observe(r, watched ? iterate.objective() : 0.0, 1 / L);
    if (monitor.improved()) iterate.keep_best();
    if (stop) {
      status = *stop;
      break;
    }
    MomentumDirection d;
    for (;;) {  // d = Pi_K(y - P^-1 g(y) / L) - y, L raised until it bounds the curvature along d
      d = iterate.momentum_direction(1 / L);
      const double dAd = iterate.curvature();
      ++monitor.products;
      require_curvature(dAd, d.dPd);
      if (dAd <= L * d.dPd || !(d.dPd > 0)) break;
      L = std::max(2 * L, dAd / d.dPd);
    }
    // <y - x+, x+ - x> > 0 in the P metric: the momentum points uphill
    const bool uphill = -(d.dPd + d.dPm) > 0;
    const double theta_next = 0.5 * theta * (std::sqrt(theta * theta + 4) - theta);
    const double beta = uphill ? 0.0 : theta * (1 - theta) / (theta * theta + theta_next);
    theta = uphill ? 1.0 : theta_next;
    L *= relaxation;
    r = std::sqrt(iterate.accelerate(beta)) / scale;
    ++since_refresh;
  }
  iterate.extract_best(x);
  return finish(problem, options, "apgd", std::move(x), status, monitor);
}

}  // namespace

Solution apgd(const Problem& problem, const Options& options) {
  return std::visit(
      [&]<class Op>(const Op& A) {
        if constexpr (std::is_same_v<Op, ContactOperator>)
          return run(problem, options,
                     ContactIterate(A, problem.K, problem.b, problem.P, options.law, options.threads));
        else
          return run(problem, options, PlainIterate<Op>(A, problem, options.law));
      },
      problem.A);
}

}  // namespace amontons
