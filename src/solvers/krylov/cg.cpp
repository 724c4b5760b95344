// Preconditioned conjugate gradients for K = R^m, A x = -b (Hestenes, Stiefel 1952). For a singular but
// consistent A it converges to a solution as it stands. The preconditioner is P, or one factorisation of
// A + 1e-8 P: then all but the softest modes of a long chain of joints are solved at once, and redundant
// joints do no harm. beta is that of Polak and Ribiere, which forgives the rounding of the factorisation
// (Golub, Ye 1999).
#include "amontons/solvers/krylov/cg.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"

namespace amontons {

namespace {

// Curvature relative to P below which a direction counts as one of A p = 0.
constexpr double null_space = 1e-15;
constexpr double shift = 1e-8;  // of A + shift P

struct Diagonal {  // z = P^-1 r
  static constexpr Limits limits{100000, 10000, 100};
  const Problem& problem;
  Diagonal(const Problem& p, Monitor&) : problem(p) {}
  void operator()(const std::vector<double>& r, std::vector<double>& z) {
    for (std::size_t i = 0; i < r.size(); ++i) z[i] = r[i] / problem.P[i];
  }
};

struct Factored {  // z = (A + shift P)^-1 r
  static constexpr Limits limits{200, 50, 1};
  ShiftedSystem system;
  Monitor& monitor;
  Factored(const Problem& problem, Monitor& m) : system(problem), monitor(m) {
    std::vector<double> R(system.factor_size());
    for (std::size_t b = 0; b < R.size(); ++b) R[b] = 1 / std::sqrt(shift * problem.P[b]);
    system.factor(R);
    ++monitor.factorizations;
  }
  void operator()(const std::vector<double>& r, std::vector<double>& z) {
    system.solve(r, z, 0);  // the products of a refinement would cost more than the iterations that it saves
    ++monitor.products;
  }
};

template <class Preconditioner>
struct ConjugateGradients : VectorIterate {
  static constexpr const char* name = "cg";
  static constexpr Limits limits = Preconditioner::limits;
  std::optional<Preconditioner> precondition;
  std::vector<double> z, p, q, previous;
  double rz = 0;

  using VectorIterate::VectorIterate;
  double start(const Start& s) {
    precondition.emplace(problem, monitor);
    for (std::vector<double>* v : {&z, &p, &q, &previous}) v->assign(s.x.size(), 0.0);
    return VectorIterate::start(s);
  }

  // The residual of the linear system is -u.
  std::optional<double> step() {
    const std::size_t m = x.size();
    (*precondition)(u, z);
    double next_rz = 0, correlation = 0;
    for (std::size_t i = 0; i < m; ++i) {
      next_rz += u[i] * z[i];
      correlation += previous[i] * z[i];
    }
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
    if (!(pAp > null_space * pPp)) return std::nullopt;  // what is left of the residual cannot be reached
    const double alpha = rz / pAp;
    for (std::size_t i = 0; i < m; ++i) {
      x[i] += alpha * p[i];
      u[i] += alpha * q[i];
    }
    return natural_map(problem, options.law, x, u);
  }
};

}  // namespace

Solution cg(const Problem& problem, const Options& options) {
  AMONTONS_REQUIRE(problem.K.all_free(),
                   "cg solves purely bilateral problems (every cone R) only; this one has inequalities or "
                   "friction: use p-spg-fb");
  return drive<ConjugateGradients<Diagonal>>(problem, options);
}

Solution factored_cg(const Problem& problem, const Options& options) {
  return drive<ConjugateGradients<Factored>>(problem, options);
}

}  // namespace amontons
