// Preconditioned conjugate gradients for K = R^m, where the VI is the linear system A x = -b with the
// residual -u (Hestenes, Stiefel 1952). With z = C^-1 u for a preconditioner C the recurrences are
//
//     beta  = <u - u_old, z> / <u_old, z_old>,  at least 0
//     p    := -z + beta p,     alpha = <u, z> / <p, A p>
//     x    := x + alpha p,     u := u + alpha A p.
//
// One product with A per iteration; the error in the A norm falls in each. For a singular A with b in its
// range the iterates stay in that range and converge to a solution: redundant but consistent joints do no
// harm. If b is not in the range, the curvature of p vanishes sooner or later and the method stops. p is then
// the contradiction of the rows, A p = 0 with <b, p> < 0, and finish() proves it.
//
// beta is that of Polak and Ribiere. In exact arithmetic <u_old, z> = 0, and it equals that of Fletcher and
// Reeves. But it tolerates a C that differs slightly between iterations, for example by the rounding of a
// factorisation (Golub, Ye 1999).
#include "amontons/solvers/krylov/cg.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"

namespace amontons {

namespace {

// Curvature relative to P below which A p counts as zero: the rounding of one product.
constexpr double null_space = 1e-15;
// C = A + shift P. Modes of A far above the shift are solved at once; redundant joints get a pivot of shift
// P. A smaller shift would be lost in the rounding of the factorisation. A larger one leaves more soft modes
// to the iterations.
constexpr double shift = 1e-8;

// C = P: z = P^-1 r, without a unit like the residual. Many cheap iterations.
struct Diagonal {
  static constexpr Limits limits{100000, 10000, 100};
  const Problem& problem;
  Diagonal(const Problem& p, Monitor&) : problem(p) {}
  void operator()(const std::vector<double>& r, std::vector<double>& z) {
    for (std::size_t i = 0; i < r.size(); ++i) z[i] = r[i] / problem.P[i];
  }
};

// C = A + shift P: z = C^-1 r. Few iterations, each with two triangular solves. It is as good as a direct
// method and also works if A is singular. u is formed afresh in each iteration, because one step cancels many
// of its digits.
struct Factored {
  static constexpr Limits limits{200, 50, 1};
  ShiftedSystem system;
  Monitor& monitor;
  Factored(const Problem& problem, Monitor& m) : system(problem), monitor(m) {
    // The shifted system is A + (R R')^-1, with one row per block where K = R^m.
    std::vector<double> R(system.factor_size());
    for (std::size_t b = 0; b < R.size(); ++b) R[b] = 1 / std::sqrt(shift * problem.P[b]);
    system.factor(R);
    monitor.count_factorization(system.factor_work());
  }
  void operator()(const std::vector<double>& r, std::vector<double>& z) {
    // A refinement would need more products than the iterations that it saves.
    system.solve(r, z, 0);
    ++monitor.products;
  }
};

template <class Preconditioner>
struct ConjugateGradients : VectorIterate {
  static constexpr const char* name = "cg";
  static constexpr Limits limits = Preconditioner::limits;
  std::optional<Preconditioner> precondition;
  // p: the direction, q = A p, previous = u_old.
  std::vector<double> z, p, q, previous;
  // <u_old, z_old>
  double rz = 0;

  using VectorIterate::VectorIterate;
  double start(const Start& s) {
    precondition.emplace(problem, monitor);
    for (std::vector<double>* v : {&z, &p, &q, &previous}) v->assign(s.x.size(), 0.0);
    return VectorIterate::start(s);
  }

  std::optional<double> step() {
    const std::size_t m = x.size();
    (*precondition)(u, z);
    double next_rz = 0, correlation = 0;
    for (std::size_t i = 0; i < m; ++i) {
      next_rz += u[i] * z[i];
      correlation += previous[i] * z[i];
    }
    // The first step has no previous direction. A negative beta is replaced by zero: steepest descent.
    const double beta = rz > 0 ? std::max(0.0, (next_rz - correlation) / rz) : 0.0;
    rz = next_rz;
    for (std::size_t i = 0; i < m; ++i) p[i] = -z[i] + beta * p[i];
    previous = u;
    product(problem.A, p, q);
    ++monitor.products;
    double pAp = 0, pPp = 0;
    for (std::size_t i = 0; i < m; ++i) {
      pAp += p[i] * q[i];
      pPp += problem.P[i] * p[i] * p[i];
    }
    require_curvature(pAp, pPp);
    // The remaining residual cannot be reduced.
    if (!(pAp > null_space * pPp)) return std::nullopt;
    const double alpha = rz / pAp;
    for (std::size_t i = 0; i < m; ++i) {
      x[i] += alpha * p[i];
      u[i] += alpha * q[i];
    }
    return natural_map(problem, law_of(problem, options), x, u);
  }
  // Not x: it has the part of the solution in it, which hides the contradiction until x is many times as
  // long. p is conjugate to that part, and so free of it.
  void last(std::vector<double>& out) const { out = p; }
};

}  // namespace

std::unique_ptr<Run> start_cg(const Problem& problem, const Options& options, Budget& budget) {
  return drive<ConjugateGradients<Diagonal>>(problem, options, budget);
}

std::unique_ptr<Run> start_factored_cg(const Problem& problem, const Options& options, Budget& budget) {
  return drive<ConjugateGradients<Factored>>(problem, options, budget);
}

Solution cg(const Problem& problem, const Options& options, Budget& budget) {
  AMONTONS_REQUIRE(problem.K.all_bilateral(),
                   "cg solves purely bilateral problems (every cone R) only; this one has inequalities or "
                   "friction: use p-spg-fb");
  return complete(start_cg(problem, options, budget));
}

}  // namespace amontons
