// Preconditioned MINRES for K = R^m, A x = -b: Paige, Saunders, "Solution of sparse indefinite systems of
// linear equations", SINUM 1975. The residual in the P^-1 norm, which is the natural map here, decreases
// monotonically, also when A is singular.
#include <algorithm>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/driver/phases.hpp"

namespace amontons {

Solution minres(const Problem& problem, const Options& options) {
  AMONTONS_REQUIRE(problem.K.all_free(),
                   "minres solves purely bilateral problems (every cone R) only; this one has inequalities "
                   "or friction: use "
                   "p-spg-fb");
  const std::size_t m = problem.rows();
  Monitor monitor(options, 100000, 10000);
  const double scale = natural_map_at_zero(problem, options.law);
  std::vector<double> x(m), u(m), best(m);
  double r = starting_point(problem, options, x, u, monitor);
  best = x;

  // Lanczos vectors of P^-1/2 A P^-1/2 in unscaled form: v_k (residual space) and z_k = P^-1 v_k.
  std::vector<double> v(m), v_old(m), v_next(m), z(m), w(m), w_old(m), w_older(m);
  double beta = 0;
  for (std::size_t i = 0; i < m; ++i) v[i] = -u[i], z[i] = v[i] / problem.P[i], beta += v[i] * z[i];
  beta = std::sqrt(beta);
  double largest = 0, eta = beta, c = 1, c_old = 1, s = 0, s_old = 0;
  Status status;
  for (std::size_t j = 0;; ++j) {
    // The recurrence knows the residual norm |eta|; u is formed when it is needed and now and then.
    if (j > 0) r = std::abs(eta) / scale;
    if (j > 0 && (r <= options.tolerance || j % 50 == 0))
      r = evaluate(problem, options.law, x, u, monitor) / scale;
    const auto stop = monitor.observe(r, objective(problem, x, u));
    if (monitor.improved()) best = x;
    if (stop) {
      status = *stop;
      break;
    }
    if (!(beta > 0)) {  // the Krylov space is exhausted
      status = Status::stalled;
      break;
    }
    for (std::size_t i = 0; i < m; ++i) v[i] /= beta, z[i] /= beta;
    product(problem.A, z, v_next);
    ++monitor.products;
    double alpha = 0;
    for (std::size_t i = 0; i < m; ++i) alpha += z[i] * v_next[i];
    for (std::size_t i = 0; i < m; ++i) v_next[i] -= alpha * v[i] + (j > 0 ? beta : 0.0) * v_old[i];
    double beta_next = 0;
    // Two Givens rotations carry the new column of the tridiagonal matrix to the triangular factor.
    const double delta = c * alpha - c_old * s * (j > 0 ? beta : 0.0);
    const double rho2 = s * alpha + c_old * c * (j > 0 ? beta : 0.0), rho3 = s_old * (j > 0 ? beta : 0.0);
    for (std::size_t i = 0; i < m; ++i) beta_next += v_next[i] * v_next[i] / problem.P[i];
    beta_next = std::sqrt(beta_next);
    const double rho1 = std::hypot(delta, beta_next);
    largest = std::max(largest, rho1);
    if (!(rho1 > 1e-13 * largest)) {  // a null direction: what is left of the residual cannot be reached
      status = Status::stalled;
      break;
    }
    c_old = c, s_old = s;
    c = delta / rho1, s = beta_next / rho1;
    w_older.swap(w_old), w_old.swap(w);
    for (std::size_t i = 0; i < m; ++i) {
      w[i] = (z[i] - rho3 * w_older[i] - rho2 * w_old[i]) / rho1;
      x[i] += c * eta * w[i];
    }
    eta = -s * eta;
    v_old.swap(v), v.swap(v_next);
    beta = beta_next;
    for (std::size_t i = 0; i < m; ++i) z[i] = v[i] / problem.P[i];
  }
  return finish(problem, options, "minres", std::move(best), status, monitor);
}

}  // namespace amontons
