// ADMM with over-relaxation on x = z, z in K, in the P metric:
//
//     x := (A + rho P)^-1 (rho P (z - w) - b),   z := Pi_K(x^ + w),   w := w + x^ - z,   x^ = 1.6 x + (1 - 1.6) z_old,
//
// with one factorisation of A + rho P, in body space where there are bodies. Sources: Boyd et al. 2011; Stellato et al.,
// "OSQP", 2020 (relaxation, balancing of rho); the De Saxce term refreshed inside the loop as in Carpentier et al. 2024.
#include <algorithm>
#include <cmath>

#include "amontons/solvers/monitor.hpp"
#include "amontons/solvers/shifted_system.hpp"
#include "amontons/solvers/solvers.hpp"
#include "phases.hpp"

namespace amontons {

namespace {

constexpr double relaxation = 1.6;
constexpr double first_rho = 0.1;
constexpr std::size_t balance_period = 25;  // iterations between two looks at the balance of the residuals
constexpr double balance_factor = 5;        // rho changes, and A + rho P is factored again, beyond this factor

void factor(const Problem& problem, ShiftedSystem& system, double rho, std::vector<double>& R, Monitor& monitor) {
  for_each_block(problem.K, [&]<class Cone>(const Cone&, std::size_t block, std::size_t) {
    double* r = &R[system.factor_offset(block)];
    for (int k = 0; k < Cone::dim; ++k) r[(Cone::dim + 1) * k] = 1 / std::sqrt(rho * problem.P[block]);
  });
  system.factor(R);
  ++monitor.factorizations;
}

}  // namespace

Solution admm(const Problem& problem, const Options& options) {
  const std::size_t m = problem.rows();
  Monitor monitor(options, 20000, 2000);
  const double scale = natural_map_at_zero(problem, options.law);
  ShiftedSystem system(problem);
  std::vector<double> x(m), z(m), u(m), w(m), rhs(m), best(m), R(system.factor_size());
  double r = starting_point(problem, options, z, u, monitor);
  double rho = options.admm.rho > 0 ? options.admm.rho : first_rho;
  best = z;
  for_each_block(problem.K, [&]<class Cone>(const Cone& cone, std::size_t block, std::size_t row) {
    add_saxce_term(cone, options.law, &u[row], &w[row]);  // the scaled multiplier of a solution is -g / (rho P)
    for (int k = 0; k < Cone::dim; ++k) w[row + k] /= -rho * problem.P[block];
  });
  factor(problem, system, rho, R, monitor);
  double primal = 0, dual = 0;
  std::size_t next_balance = balance_period;
  Status status;
  for (std::size_t j = 1;; ++j) {
    const auto stop = monitor.observe(r, objective(problem, z, u), rho);
    if (monitor.improved()) best = z;
    if (stop) {
      status = *stop;
      break;
    }
    for_each_block(problem.K, [&]<class Cone>(const Cone& cone, std::size_t block, std::size_t row) {
      double g[Cone::dim];
      add_saxce_term(cone, options.law, &u[row], g);
      for (int k = 0; k < Cone::dim; ++k)
        rhs[row + k] = rho * problem.P[block] * (z[row + k] - w[row + k]) - problem.b[row + k] - (g[k] - u[row + k]);
    });
    system.solve(rhs, x, 0);
    ++monitor.products;
    primal = dual = 0;
    for_each_block(problem.K, [&]<class Cone>(const Cone& cone, std::size_t block, std::size_t row) {
      double trial[Cone::dim], old[Cone::dim];
      for (int k = 0; k < Cone::dim; ++k) {
        old[k] = z[row + k];
        w[row + k] += relaxation * x[row + k] + (1 - relaxation) * old[k];
        trial[k] = w[row + k];
      }
      cone.project(trial, &z[row]);
      for (int k = 0; k < Cone::dim; ++k) {
        w[row + k] -= z[row + k];
        const double p = x[row + k] - z[row + k], d = z[row + k] - old[k];
        primal += problem.P[block] * p * p;
        dual += problem.P[block] * d * d;
      }
    });
    r = evaluate(problem, options.law, z, u, monitor) / scale;
    if (options.admm.rho > 0 || j < next_balance) continue;
    // |x - z| against rho |z - z_old|: their ratio says by what factor rho is off. The waits double, so that the
    // factorisations stay few and rho settles.
    next_balance = 2 * j;
    const double ratio = std::sqrt(primal) / std::max(rho * std::sqrt(dual), 1e-300);
    if (ratio < balance_factor && ratio > 1 / balance_factor) continue;
    const double next = std::clamp(rho * ratio, 1e-6, 1e6);
    for (double& v : w) v *= rho / next;
    rho = next;
    factor(problem, system, rho, R, monitor);
  }
  return finish(problem, options, "admm", std::move(best), status, monitor);
}

}  // namespace amontons
