// Preconditioned conjugate gradients for K = R^m, A x = -b (Hestenes, Stiefel 1952). For a singular but
// consistent A it converges to a solution as it stands.
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/solvers/monitor.hpp"
#include "amontons/solvers/solvers.hpp"
#include "phases.hpp"

namespace amontons {

Solution cg(const Problem& problem, const Options& options) {
  AMONTONS_REQUIRE(problem.K.all_free(),
                   "cg solves purely bilateral problems (every cone R) only; this one has inequalities or "
                   "friction: use p-spg-fb");
  constexpr std::size_t refresh = 100;
  constexpr double null_space =
      1e-15;  // curvature relative to P below which a direction counts as one of A p = 0
  const std::size_t m = problem.rows();
  Monitor monitor(options, 100000, 10000);
  const double scale = natural_map_at_zero(problem, options.law);
  std::vector<double> x(m), u(m), z(m), p(m), q(m), best(m);
  double r = starting_point(problem, options, x, u, monitor), rz = 0;
  best = x;
  Status status;
  for (std::size_t j = 0;; ++j) {
    if (j > 0 && (j % refresh == 0 || r <= options.tolerance))
      r = evaluate(problem, options.law, x, u, monitor) / scale;
    const auto stop = monitor.observe(r, objective(problem, x, u));
    if (monitor.improved()) best = x;
    if (stop) {
      status = *stop;
      break;
    }
    double next_rz = 0, pAp = 0, pPp = 0;  // the residual of the linear system is -u
    for (std::size_t i = 0; i < m; ++i) z[i] = u[i] / problem.P[i], next_rz += u[i] * z[i];
    const double beta = rz > 0 ? next_rz / rz : 0.0;
    rz = next_rz;
    for (std::size_t i = 0; i < m; ++i) p[i] = -z[i] + beta * p[i];
    product(problem.A, p, q);
    ++monitor.products;
    for (std::size_t i = 0; i < m; ++i) pAp += p[i] * q[i], pPp += problem.P[i] * p[i] * p[i];
    require_curvature(pAp, pPp);
    if (!(pAp > null_space * pPp)) {  // p in the null space of A: the rest of the residual cannot be reached
      status = Status::stalled;
      break;
    }
    const double alpha = rz / pAp;
    for (std::size_t i = 0; i < m; ++i) x[i] += alpha * p[i], u[i] += alpha * q[i];
    r = natural_map(problem, options.law, x, u) / scale;
  }
  return finish(problem, options, "cg", std::move(best), status, monitor);
}

}  // namespace amontons
