// Preconditioned MINRES for K = R^m, A x = -b: Paige, Saunders, "Solution of sparse indefinite systems of
// linear equations", SINUM 1975.
//
// Lanczos on P^-1/2 A P^-1/2 in unscaled form: v_k in the space of the residual, z_k = P^-1 v_k,
//
//     beta_{k+1} v_{k+1} = A z_k - alpha_k v_k - beta_k v_{k-1},   alpha_k = <z_k, A z_k>,
//
// with <v_j, z_k> = 1 for j = k and 0 else, gives A Z_k = V_{k+1} T_k with T_k tridiagonal. x_k minimises |A
// x + b| in the P^-1 norm over the span of z_1 .. z_k, a least-squares problem in T_k. One new Givens
// rotation per step brings T_k to the triangle R_k. The columns w_k of Z_k R_k^-1 then follow a recurrence of
// three terms. The norm of the residual is the last entry eta of the rotated right-hand side, known without
// u. On R^m the natural map is P^-1/2 u, so eta is the residual of this library. It falls in every step, also
// when A is singular.
#include "amontons/solvers/krylov/minres.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/elementary.hpp"
#include "amontons/base/error.hpp"
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

namespace {

struct Minres : VectorIterate {
  static constexpr const char* name = "minres";
  static constexpr Limits limits{100000, 10000, 50};
  // A pivot of R below this fraction of the largest one belongs to a null direction of A: rounding of
  // Lanczos.
  static constexpr double null_pivot = 1e-13;
  // Between two steps v is not yet divided by beta; v_next is scratch.
  std::vector<double> v, v_old, v_next, z, w, w_old, w_older;
  // (c, s), (c_old, s_old): the last two rotations. largest: the largest pivot so far.
  double beta = 0, beta_old = 0, largest = 0, eta = 0, c = 1, c_old = 1, s = 0, s_old = 0;

  using VectorIterate::VectorIterate;
  double start(const Start& start) {
    for (std::vector<double>* a : {&v, &v_old, &v_next, &z, &w, &w_old, &w_older})
      a->assign(start.x.size(), 0.0);
    for (std::size_t i = 0; i < v.size(); ++i) {
      v[i] = -start.u[i];
      z[i] = v[i] / problem.P[i];
      beta += v[i] * z[i];
    }
    eta = beta = std::sqrt(beta);
    return VectorIterate::start(start);
  }

  std::optional<double> step() {
    const std::size_t m = x.size();
    if (!(beta > 0)) return std::nullopt;  // the Krylov space is exhausted
    for (std::size_t i = 0; i < m; ++i) {
      v[i] /= beta;
      z[i] /= beta;
    }
    product(problem.A, z, v_next);
    ++monitor.products;
    double alpha = 0, beta_next = 0;
    for (std::size_t i = 0; i < m; ++i) alpha += z[i] * v_next[i];
    for (std::size_t i = 0; i < m; ++i) {
      v_next[i] -= alpha * v[i] + beta_old * v_old[i];
      beta_next += v_next[i] * v_next[i] / problem.P[i];
    }
    beta_next = std::sqrt(beta_next);
    if (!rotate(alpha, beta_next)) return std::nullopt;
    v_old.swap(v);
    v.swap(v_next);
    beta_old = beta = beta_next;
    for (std::size_t i = 0; i < m; ++i) z[i] = v[i] / problem.P[i];
    return std::abs(eta);
  }

  // The last two rotations carry the new column (beta_k, alpha_k, beta_{k+1}) of T to R, where it becomes
  // (rho3, rho2, delta, beta_{k+1}). A third one turns its last two entries into (rho1, 0), and x follows:
  //
  //     w_k = (z_k - rho3 w_{k-2} - rho2 w_{k-1}) / rho1,   x := x + c eta w_k,   eta := -s eta.
  //
  // The residual is eta times the last basis vector, rotated back by all rotations. Only the last rotation is
  // new, hence u := s^2 u + (c eta / rho1) beta_{k+1} v_{k+1}, with the eta before this step.
  //
  // False for a null direction: the remaining residual cannot be reduced.
  bool rotate(double alpha, double beta_next) {
    const double delta = c * alpha - c_old * s * beta_old;
    const double rho2 = s * alpha + c_old * c * beta_old, rho3 = s_old * beta_old;
    const double rho1 = elementary::hypot(delta, beta_next);
    largest = std::max(largest, rho1);
    if (!(rho1 > null_pivot * largest)) return false;
    c_old = c;
    s_old = s;
    c = delta / rho1;
    s = beta_next / rho1;
    w_older.swap(w_old);
    w_old.swap(w);
    for (std::size_t i = 0; i < x.size(); ++i) {
      w[i] = (z[i] - rho3 * w_older[i] - rho2 * w_old[i]) / rho1;
      x[i] += c * eta * w[i];
      u[i] = s * s * u[i] + c * eta / rho1 * v_next[i];
    }
    eta = -s * eta;
    return true;
  }
};

}  // namespace

Solution minres(const Problem& problem, const Options& options, Budget& budget) {
  AMONTONS_REQUIRE(
      problem.K.all_bilateral(),
      "minres solves purely bilateral problems (every cone R) only; this one has inequalities or "
      "friction: use p-spg-fb");
  return complete(drive<Minres>(problem, options, budget));
}

}  // namespace amontons
