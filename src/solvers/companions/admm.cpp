// ADMM with over-relaxation on x = z, z in K, in the P metric:
//
//     x := (A + rho P)^-1 (rho P (z - w) - b),   z := Pi_K(x^ + w),   w := w + x^ - z,   x^ = 1.6 x + (1
//     - 1.6) z_old,
//
// with one factorisation of A + rho P, in body space where there are bodies. Sources: Boyd et al. 2011;
// Stellato et al., "OSQP", 2020 (relaxation, balancing of rho); the De Saxce term refreshed inside the loop
// as in Carpentier et al. 2024.
#include <algorithm>
#include <cmath>

#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/companions/anderson.hpp"
#include "solvers/driver/phases.hpp"

namespace amontons {

namespace {

constexpr double relaxation = 1.6;
constexpr int memory = 10;  // of the Anderson acceleration
constexpr double first_rho = 0.03;
constexpr std::size_t balance_period = 25;  // iterations between two looks at the balance of the residuals
constexpr double balance_factor = 5;  // rho changes, and A + rho P is factored again, beyond this factor

void factor(const Problem& problem, ShiftedSystem& system, double rho, std::vector<double>& R,
            Monitor& monitor) {
  for_each_block(problem.K, [&]<class Set>(const Set&, std::size_t block, std::size_t) {
    double* r = &R[system.factor_offset(block)];
    for (int k = 0; k < Set::dim; ++k) r[(Set::dim + 1) * k] = 1 / std::sqrt(rho * problem.P[block]);
  });
  system.factor(R);
  ++monitor.factorizations;
}

}  // namespace

// One ADMM iteration is the fixed-point map t := F(t) of t = x^ + w, the point before projection: z =
// Pi_K(t), w = t - z. Anderson acceleration works on t, in the P metric (rows scaled by P^1/2).
Solution admm(const Problem& problem, const Options& options) {
  const std::size_t m = problem.rows();
  Monitor monitor(options, 20000, 2000);
  const double scale = natural_map_at_zero(problem, options.law);
  ShiftedSystem system(problem);
  std::vector<double> x(m), z(m), u(m), t(m), image(m), rhs(m), best(m), R(system.factor_size());
  const double start = starting_point(problem, options, z, u, monitor);
  double r = start;
  double rho = options.admm.rho > 0 ? options.admm.rho : first_rho;
  best = z;
  if (start <= options.tolerance) {  // the first iteration would leave a solution again
    monitor.observe(start, objective(problem, z, u), rho);
    return finish(problem, options, "admm", std::move(best), Status::converged, monitor);
  }
  // t and image hold P^1/2 t. At a solution w = -g / (rho P).
  for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
    const double root = std::sqrt(problem.P[block]);
    double g[Set::dim];
    add_saxce_term(set, options.law, &u[row], g);
    for (int k = 0; k < Set::dim; ++k) t[row + k] = root * (z[row + k] - g[k] / (rho * problem.P[block]));
  });
  factor(problem, system, rho, R, monitor);
  Anderson anderson(m, memory);
  std::size_t next_balance = balance_period;
  Status status;
  for (std::size_t j = 1;; ++j) {
    // z = Pi_K(t), u = A z + b, and the right-hand side rho P (z - w) - b - s with w = t - z
    for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
      const double root = std::sqrt(problem.P[block]);
      double trial[Set::dim];
      for (int k = 0; k < Set::dim; ++k) trial[k] = t[row + k] / root;
      set.project(trial, &z[row]);
    });
    r = evaluate(problem, options.law, z, u, monitor) / scale;
    const auto stop = monitor.observe(r, objective(problem, z, u), rho);
    if (monitor.improved() && r < start) best = z;
    if (stop) {
      status = *stop;
      break;
    }
    // Under coulomb u_t in the De Saxce term is taken from the multiplier, -rho P w = u + s e_n: it lies in
    // the dual cone at every iteration, while A z + b is rough until the end.
    for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
      const double p = problem.P[block], root = std::sqrt(p);
      double v[Set::dim], g[Set::dim];
      for (int k = 0; k < Set::dim; ++k) v[k] = rho * p * (z[row + k] - t[row + k] / root);
      add_saxce_term(set, options.law, v, g);
      for (int k = 0; k < Set::dim; ++k)
        rhs[row + k] = rho * p * z[row + k] + v[k] - problem.b[row + k] - (g[k] - v[k]);
    });
    system.solve(rhs, x, 0);
    ++monitor.products;
    double primal = 0, dual = 0;
    for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
      const double p = problem.P[block], root = std::sqrt(p);
      double trial[Set::dim], next[Set::dim];
      for (int k = 0; k < Set::dim; ++k) {
        trial[k] = t[row + k] / root + relaxation * (x[row + k] - z[row + k]);
        image[row + k] = root * trial[k];
      }
      set.project(trial, next);
      for (int k = 0; k < Set::dim; ++k) {
        primal += p * (x[row + k] - next[k]) * (x[row + k] - next[k]);
        dual += p * (next[k] - z[row + k]) * (next[k] - z[row + k]);
      }
    });
    anderson.advance(t, image);
    if (options.admm.rho > 0 || j < next_balance) continue;
    // |x - z| against rho |z - z_old|: their ratio says by what factor rho is off. The waits double, so that
    // the factorisations stay few and rho settles.
    next_balance = 2 * j;
    const double ratio = std::sqrt(primal) / std::max(rho * std::sqrt(dual), 1e-300);
    if (ratio < balance_factor && ratio > 1 / balance_factor) continue;
    const double next = std::clamp(rho * ratio, 1e-6, 1e6);
    for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
      const double root = std::sqrt(problem.P[block]);
      double trial[Set::dim], foot[Set::dim];
      for (int k = 0; k < Set::dim; ++k) trial[k] = t[row + k] / root;
      set.project(trial, foot);
      for (int k = 0; k < Set::dim; ++k) t[row + k] = root * (foot[k] + (trial[k] - foot[k]) * rho / next);
    });
    rho = next;
    factor(problem, system, rho, R, monitor);
    anderson.reset();
  }
  return finish(problem, options, "admm", std::move(best), status, monitor);
}

}  // namespace amontons
