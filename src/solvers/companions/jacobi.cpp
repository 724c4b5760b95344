// Projected Jacobi in the P metric, x := Pi_K(x - omega P^-1 g): the projected gradient method with a fixed
// step. Without projection the error e obeys e := (I - omega P^-1 A) e. It shrinks along every eigenvector of
// P^-1 A with a positive eigenvalue lambda if |1 - omega lambda| < 1, that is for 0 < omega < 2 / lambda_max.
// The projection does not lengthen it in the P metric, because P is a number per block. The slowest mode
// shrinks by 1 - omega lambda_min. Iterations thus grow with the condition; the spectral steps of P-SPG-FB
// mostly avoid this. Source: Tasora, Anitescu 2011 (fixed-point iteration).
#include "amontons/solvers/companions/jacobi.hpp"

#include <cmath>

#include "amontons/base/elementary.hpp"
#include "amontons/base/leave.hpp"
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

namespace {

// Power iterations tend to lambda_max, mostly from below. They are some per cent short if the largest
// eigenvalues are close together; the factor makes up for that. An estimate of half lambda_max would still
// converge.
constexpr int power_iterations = 20;
constexpr double estimate_factor = 1.1;

// An upper estimate of lambda_max(P^-1 A); 1 for A = 0. The start vector is fixed, so that the result is
// reproducible, and unsymmetric, so that no symmetry of the scene hides an eigenvector.
double largest_eigenvalue(const Problem& problem, Monitor& monitor) {
  const std::size_t m = problem.rows();
  std::vector<double> v(m), Av(m);
  for (std::size_t i = 0; i < m; ++i) v[i] = 1 + 0.5 * elementary::sin(1.0 + i);
  double lambda = 0;
  for (int k = 0; k < power_iterations; ++k) {
    leave_if_due();
    double norm = 0;
    for (double value : v) norm += value * value;
    norm = std::sqrt(norm);
    if (!(norm > 0)) return 1;
    for (double& value : v) value /= norm;
    product(problem.A, v, Av);
    ++monitor.products;
    lambda = 0;
    for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      for (std::size_t i = row; i < row + S::dim; ++i) {
        v[i] = Av[i] / problem.P[block];
        lambda += v[i] * v[i];
      }
    });
    lambda = std::sqrt(lambda);
  }
  return lambda > 0 ? estimate_factor * lambda : 1;
}

struct Jacobi : VectorIterate {
  static constexpr const char* name = "jacobi";
  static constexpr Limits limits{100000, 10000, 0};
  double omega = 0;

  using VectorIterate::VectorIterate;
  double start(const Start& s) {
    omega = options.jacobi.omega > 0 ? options.jacobi.omega : 1 / largest_eigenvalue(problem, monitor);
    return VectorIterate::start(s);
  }
  std::optional<double> step() {
    for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double g[S::dim];
      add_de_saxce_term(set, law_of(problem, options), &u[row], g);
      for (int k = 0; k < S::dim; ++k) g[k] = x[row + k] - omega * g[k] / problem.P[block];
      set.project(g, &x[row]);
    });
    return evaluate();
  }
  double step_size() const { return omega; }
};

}  // namespace

Solution jacobi(const Problem& problem, const Options& options, Budget& budget) {
  return complete(drive<Jacobi>(problem, options, budget));
}

}  // namespace amontons
