// Projected Jacobi in the P metric, x := Pi_K(x - omega P^-1 g): the projected gradient method with a fixed
// step, which converges for 0 < omega < 2 / lambda_max(P^-1 A). Source: Tasora, Anitescu 2011 (fixed-point
// iteration).
#include <cmath>

#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/driver/phases.hpp"

namespace amontons {

namespace {

// An upper estimate of lambda_max(P^-1 A) by power iterations from a fixed vector; 10 % on top for what they
// miss.
double largest_eigenvalue(const Problem& problem, Monitor& monitor) {
  const std::size_t m = problem.rows();
  std::vector<double> v(m), Av(m);
  for (std::size_t i = 0; i < m; ++i) v[i] = 1 + 0.5 * std::sin(1.0 + i);
  double lambda = 0;
  for (int k = 0; k < 20; ++k) {
    double norm = 0;
    for (double value : v) norm += value * value;
    norm = std::sqrt(norm);
    if (!(norm > 0)) return 1;
    for (double& value : v) value /= norm;
    product(problem.A, v, Av);
    ++monitor.products;
    lambda = 0;
    for_each_block(problem.K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
      for (int i = 0; i < Set::dim; ++i)
        v[row + i] = Av[row + i] / problem.P[block], lambda += v[row + i] * v[row + i];
    });
    lambda = std::sqrt(lambda);
  }
  return lambda > 0 ? 1.1 * lambda : 1;
}

}  // namespace

Solution jacobi(const Problem& problem, const Options& options) {
  const std::size_t m = problem.rows();
  Monitor monitor(options, 100000, 10000);
  const double scale = natural_map_at_zero(problem, options.law);
  std::vector<double> x(m), u(m), best(m);
  double r = starting_point(problem, options, x, u, monitor);
  best = x;
  const double omega =
      options.jacobi.omega > 0 ? options.jacobi.omega : 1 / largest_eigenvalue(problem, monitor);
  Status status;
  for (;;) {
    const auto stop = monitor.observe(r, objective(problem, x, u), omega);
    if (monitor.improved()) best = x;
    if (stop) {
      status = *stop;
      break;
    }
    for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
      double g[Set::dim];
      add_saxce_term(set, options.law, &u[row], g);
      for (int k = 0; k < Set::dim; ++k) g[k] = x[row + k] - omega * g[k] / problem.P[block];
      set.project(g, &x[row]);
    });
    r = evaluate(problem, options.law, x, u, monitor) / scale;
  }
  return finish(problem, options, "jacobi", std::move(best), status, monitor);
}

}  // namespace amontons
