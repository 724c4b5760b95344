// Semismooth Newton on the natural map F(x) = x - Pi_K(x - P^-1 g), g = A x + b, globalised by P-SPG-FB.
//
// With Q = Pi_K'(x - P^-1 g), an element of the generalised Jacobian, symmetric with eigenvalues in [0, 1]
// (stick: 1, 1, 1; slide: 1, f, 0; open: 0), the Newton equation is (I - Q + Q P^-1 A) dx = -F. Each cone
// contributes its face: 3 unknowns when sticking, 2 when sliding, none when open. Substituting dx = e - F, e
// = R zeta with R R' = P^-1 Q (I - Q + sigma Q)^-1 gives the symmetric system of ShiftedSystem,
//
//     (I + R'AR) zeta = R' (A F + sigma P F - P F),
//
// where the proximal weight sigma keeps it regular when A is not (hyperstatic contacts). Sources: Qi, Sun
// 1993 (semismooth Newton); Zhao, Sun, Toh 2010 (proximal semismooth Newton); Kanzow, Ferenczi, Fukushima
// 2009 (the projection on second-order cones).
#include <algorithm>
#include <cmath>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/driver/phases.hpp"

namespace amontons {

namespace {

using Vector = std::vector<double>;

constexpr std::size_t shortest_burst = 30;   // first-order iterations after a failed Newton step; doubled
constexpr std::size_t longest_burst = 2000;  // with every failure in a row, up to this
constexpr int halvings = 3;                  // of a Newton step before the first-order method takes over
constexpr double sufficient = 0.9;  // a step must bring the residual below this part of the current one

// The factor R = P^-1/2 V sqrt(q / (1 - q + sigma q)) of one block at y, V the eigenvectors of Q.
template <class Set>
void face_factor(const Set& set, double p, double sigma, const double* y, double* R) {
  const auto weight = [&](double q) { return std::sqrt(q / ((1 - q + sigma * q) * p)); };
  std::fill(R, R + Set::dim * Set::dim, 0.0);
  if constexpr (Set::dim == 1) {
    double foot;
    set.project(y, &foot);
    R[0] = foot == y[0] ? weight(1) : 0.0;
  } else {
    const double t = std::sqrt(y[1] * y[1] + y[2] * y[2]);
    if (y[0] >= 0 && t <= set.mu * y[0]) {
      for (int k = 0; k < 3; ++k) R[4 * k] = weight(1);
    } else if (set.mu * t > -y[0]) {
      // The ray (c, s tau) of the foot has q = 1, the direction along the rim q = f s / t, the normal q = 0.
      const double c = 1 / std::sqrt(1 + set.mu * set.mu), s = set.mu * c;
      const double tau[2] = {y[1] / t, y[2] / t};
      const double ray = weight(1), rim = weight(std::min(1.0, (c * y[0] + s * t) * s / t));
      R[0] = c * ray, R[3] = s * tau[0] * ray, R[6] = s * tau[1] * ray;
      R[4] = -tau[1] * rim, R[7] = tau[0] * rim;
    }
  }
}

// out = Pi_K'(y) d
template <class Set>
void derivative(const Set& set, const double* y, const double* d, double* out) {
  if constexpr (Set::dim == 1) {
    double foot;
    set.project(y, &foot);
    out[0] = foot == y[0] ? d[0] : 0.0;
  } else {
    const double t = std::sqrt(y[1] * y[1] + y[2] * y[2]);
    if (y[0] >= 0 && t <= set.mu * y[0]) {
      for (int k = 0; k < 3; ++k) out[k] = d[k];
    } else if (set.mu * t > -y[0]) {
      const double c = 1 / std::sqrt(1 + set.mu * set.mu), s = set.mu * c;
      const double tau[2] = {y[1] / t, y[2] / t};
      const double ray = c * d[0] + s * (tau[0] * d[1] + tau[1] * d[2]);
      const double rim = std::min(1.0, (c * y[0] + s * t) * s / t) * (tau[0] * d[2] - tau[1] * d[1]);
      out[0] = c * ray, out[1] = s * tau[0] * ray - tau[1] * rim, out[2] = s * tau[1] * ray + tau[0] * rim;
    } else {
      out[0] = out[1] = out[2] = 0.0;
    }
  }
}

// The linear algebra of one Newton step. Under coulomb the derivative of g is B A with B = 1 + e_n (mu u_t /
// |u_t|)' per contact, and the equation (I - Q + Q P^-1 B A) dx = -F is unsymmetric: GMRES (Saad, Schultz
// 1986) solves it, preconditioned with the symmetric system of B = 1.
class NewtonStep {
 public:
  NewtonStep(const Problem& problem, Law law)
      : problem_(problem),
        law_(law),
        system_(problem),
        R_(system_.factor_size()),
        F_(problem.rows()),
        work_(F_),
        Av_(F_) {
    if (law == Law::coulomb) basis_.assign(krylov + 1, F_), image_.assign(krylov, F_);
  }

  // dx at (x, u = A x + b).
  void direction(const Vector& x, const Vector& u, double sigma, Vector& dx, Monitor& monitor) {
    sigma_ = sigma;
    y_.resize(x.size());
    for_each_block(problem_.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
      double g[Set::dim], foot[Set::dim];
      double* y = &y_[row];
      add_saxce_term(set, law_, &u[row], g);
      for (int k = 0; k < Set::dim; ++k) y[k] = x[row + k] - g[k] / problem_.P[block];
      set.project(y, foot);
      for (int k = 0; k < Set::dim; ++k) F_[row + k] = foot[k] - x[row + k];
      face_factor(set, problem_.P[block], sigma, y, &R_[system_.factor_offset(block)]);
    });
    system_.factor(R_);
    ++monitor.factorizations;
    if (law_ == Law::coulomb)
      gmres(u, dx, monitor);
    else
      solve_symmetric(F_, dx, 1, monitor);
  }

 private:
  static constexpr int krylov = 40;
  static constexpr double krylov_tolerance = 1e-3;

  // y = (I - Q + sigma Q + Q P^-1 A)^-1 r: y = r + R zeta, (I + R'AR) zeta = R' ((1 - sigma) P r - A r).
  void solve_symmetric(const Vector& r, Vector& y, int refinements, Monitor& monitor) {
    product(problem_.A, r, work_);
    for_each_block(problem_.K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
      for (int k = 0; k < Set::dim; ++k)
        work_[row + k] = (1 - sigma_) * problem_.P[block] * r[row + k] - work_[row + k];
    });
    system_.solve(work_, y, refinements);
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += r[i];
    monitor.products += 2 + refinements;
  }

  // out = (I - Q + Q P^-1 B A) v
  void apply(const Vector& u, const Vector& v, Vector& out, Monitor& monitor) {
    product(problem_.A, v, Av_);
    ++monitor.products;
    for_each_block(problem_.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
      double d[Set::dim], Qd[Set::dim];
      for (int k = 0; k < Set::dim; ++k) d[k] = Av_[row + k];
      if constexpr (Set::dim == 3) {
        const double t = std::sqrt(u[row + 1] * u[row + 1] + u[row + 2] * u[row + 2]);
        if (t > 0) d[0] += set.mu * (u[row + 1] * d[1] + u[row + 2] * d[2]) / t;
      }
      for (int k = 0; k < Set::dim; ++k) d[k] = d[k] / problem_.P[block] - v[row + k];
      derivative(set, &y_[row], d, Qd);
      for (int k = 0; k < Set::dim; ++k) out[row + k] = v[row + k] + Qd[k];
    });
  }

  double dot(const Vector& a, const Vector& b) const {
    double sum = 0;
    for_each_block(problem_.K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
      for (int k = 0; k < Set::dim; ++k) sum += problem_.P[block] * a[row + k] * b[row + k];
    });
    return sum;
  }

  // Right preconditioned, no restart: dx = sum of y_k z_k with z_k the preconditioned basis vectors.
  void gmres(const Vector& u, Vector& dx, Monitor& monitor) {
    double H[krylov + 1][krylov], c[krylov], s[krylov], rhs[krylov + 1] = {};
    const double norm = std::sqrt(dot(F_, F_));
    std::fill(dx.begin(), dx.end(), 0.0);
    if (!(norm > 0)) return;
    for (std::size_t i = 0; i < dx.size(); ++i) basis_[0][i] = F_[i] / norm;
    rhs[0] = norm;
    int k = 0;
    while (k < krylov && std::abs(rhs[k]) > krylov_tolerance * norm && !monitor.out_of_time()) {
      solve_symmetric(basis_[k], image_[k], 0, monitor);
      Vector& next = basis_[k + 1];
      apply(u, image_[k], next, monitor);
      for (int j = 0; j <= k; ++j) {
        H[j][k] = dot(next, basis_[j]);
        for (std::size_t i = 0; i < next.size(); ++i) next[i] -= H[j][k] * basis_[j][i];
      }
      H[k + 1][k] = std::sqrt(dot(next, next));
      if (H[k + 1][k] > 0)
        for (double& v : next) v /= H[k + 1][k];
      for (int j = 0; j < k; ++j) {
        const double a = H[j][k], b = H[j + 1][k];
        H[j][k] = c[j] * a + s[j] * b, H[j + 1][k] = -s[j] * a + c[j] * b;
      }
      const double rho = std::hypot(H[k][k], H[k + 1][k]);
      if (!(rho > 0)) break;
      c[k] = H[k][k] / rho, s[k] = H[k + 1][k] / rho;
      H[k][k] = rho;
      rhs[k + 1] = -s[k] * rhs[k], rhs[k] *= c[k];
      ++k;
    }
    for (int j = k - 1; j >= 0; --j) {
      for (int i = j + 1; i < k; ++i) rhs[j] -= H[j][i] * rhs[i];
      rhs[j] /= H[j][j];
      for (std::size_t i = 0; i < dx.size(); ++i) dx[i] += rhs[j] * image_[j][i];
    }
  }

  const Problem& problem_;
  Law law_;
  ShiftedSystem system_;
  double sigma_ = 0;
  Vector R_, F_, work_, Av_, y_;  // F_ holds -F
  std::vector<Vector> basis_, image_;
};

}  // namespace

Solution newton(const Problem& problem, const Options& options) {
  const std::size_t m = problem.rows();
  Monitor monitor(options, 1000, 60);
  const double scale = natural_map_at_zero(problem, options.law);
  NewtonStep step(problem, options.law);
  Vector x(m), u(m), dx(m), best(m), trial(m), trial_u(m);
  double r = starting_point(problem, options, x, u, monitor);
  best = x;
  Status status;
  std::size_t burst = shortest_burst;
  bool interrupted = false;
  for (;;) {
    const auto stop = monitor.observe(r, objective(problem, x, u));
    if (monitor.improved()) best = x;
    if (stop || interrupted) {
      status = stop ? *stop : Status::interrupted;
      break;
    }
    const double sigma = std::clamp(1e-3 * r, 1e-12, 1e-6);
    step.direction(x, u, sigma, dx, monitor);
    bool accepted = false;
    for (int k = 0; k <= halvings && !accepted; ++k) {
      const double t = std::ldexp(1.0, -k);
      for (std::size_t i = 0; i < m; ++i) trial[i] = x[i] + t * dx[i];
      project(problem.K, trial, trial);
      const double r_trial = evaluate(problem, options.law, trial, trial_u, monitor) / scale;
      accepted = r_trial < sufficient * r;
      if (accepted) x.swap(trial), u.swap(trial_u), r = r_trial;
    }
    if (accepted) {
      burst = shortest_burst;
    } else {
      const Status phase = first_order_phase(problem, options, burst, x, monitor);
      interrupted = phase == Status::interrupted;
      burst = std::min(2 * burst, longest_burst);
      r = evaluate(problem, options.law, x, u, monitor) / scale;
    }
  }
  return finish(problem, options, "newton", std::move(best), status, monitor);
}

}  // namespace amontons
