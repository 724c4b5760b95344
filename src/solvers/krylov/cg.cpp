// Preconditioned conjugate gradients for K = R^m, A x = -b (Hestenes, Stiefel 1952). For a singular but
// consistent A it converges to a solution as it stands. The preconditioner is P, or one factorisation of
// A + 1e-8 P: then all but the softest modes of a long chain of joints are solved at once, and redundant
// joints do no harm. beta is that of Polak and Ribiere, which forgives the rounding of the factorisation
// (Golub, Ye 1999).
#include <algorithm>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/driver/phases.hpp"

namespace amontons {

namespace {

constexpr std::size_t refresh_period = 100;
// Curvature relative to P below which a direction counts as one of A p = 0.
constexpr double null_space = 1e-15;
constexpr double shift = 1e-8;  // of A + shift P

// precondition(r, z): z = M^-1 r
template <class Precondition>
Solution run(const Problem& problem, const Options& options, Monitor& monitor, std::size_t refresh,
             Precondition precondition) {
  const std::size_t m = problem.rows();
  const double scale = natural_map_at_zero(problem, options.law);
  std::vector<double> x(m), u(m), z(m), p(m), q(m), last(m), best(m);
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
    double next_rz = 0, correlation = 0, pAp = 0, pPp = 0;  // the residual of the linear system is -u
    precondition(u, z);
    for (std::size_t i = 0; i < m; ++i) next_rz += u[i] * z[i], correlation += last[i] * z[i];
    const double beta = rz > 0 ? std::max(0.0, (next_rz - correlation) / rz) : 0.0;
    rz = next_rz;
    for (std::size_t i = 0; i < m; ++i) p[i] = -z[i] + beta * p[i], last[i] = u[i];
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

}  // namespace

Solution cg(const Problem& problem, const Options& options) {
  AMONTONS_REQUIRE(problem.K.all_free(),
                   "cg solves purely bilateral problems (every cone R) only; this one has inequalities or "
                   "friction: use p-spg-fb");
  Monitor monitor(options, 100000, 10000);
  return run(problem, options, monitor, refresh_period,
             [&](const std::vector<double>& r, std::vector<double>& z) {
               for (std::size_t i = 0; i < r.size(); ++i) z[i] = r[i] / problem.P[i];
             });
}

Solution factored_cg(const Problem& problem, const Options& options) {
  Monitor monitor(options, 200, 50);
  ShiftedSystem system(problem);
  std::vector<double> R(system.factor_size());
  for (std::size_t b = 0; b < R.size(); ++b) R[b] = 1 / std::sqrt(shift * problem.P[b]);
  system.factor(R);
  ++monitor.factorizations;
  // The products of the refinement would cost more than the iterations that it saves.
  return run(problem, options, monitor, 1, [&](const std::vector<double>& r, std::vector<double>& z) {
    system.solve(r, z, 0);
    ++monitor.products;
  });
}

}  // namespace amontons
