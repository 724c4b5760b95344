// Semismooth Newton on the natural map F(x) = x - Pi_K(x - P^-1 g), g = A x + b, globalised by P-SPG-FB.
//
// Equation. F is zero exactly at a solution and piecewise smooth. With Q = Pi_K'(x - P^-1 g), an element of
// the generalised Jacobian, symmetric with eigenvalues in [0, 1] (stick: 1, 1, 1; slide: 1, f, 0; open: 0), a
// step solves, docs/algorithm.md (24),
//
//     (I - Q + Q P^-1 A) dx = -F.
//
// If Q = 1 the row says A dx = -g: u vanishes. If Q = 0 it says x + dx = Pi_K(..): x moves to its bound. So
// each cone contributes its face: 3 unknowns when sticking, 2 when sliding, 0 when open. Once the faces are
// right the step is that of a linear system. Convergence is fast near a solution; far away there is no
// guarantee.
//
// Face factor. Substituting dx = e - F gives (I - Q + Q P^-1 A) e = Q P^-1 (A F - P F). A proximal term sigma
// P on A turns I - Q into I - Q + sigma Q, which is invertible, and dividing by it and by P yields
//
//     (A + Theta^-1) e = A F + sigma P F - P F,   Theta = R R' = P^-1 Q (I - Q + sigma Q)^-1,   e = R zeta,
//     (I + R'AR) zeta = R' (A F + sigma P F - P F),
//
// the symmetric system of ShiftedSystem, where sigma keeps it regular if A is singular (hyperstatic
// contacts). It affects only the step: dx = 0 still means F = 0. It is of the order of rounding, so that the
// convergence stays superlinear.
//
// Sources: Qi, Sun 1993 (semismooth Newton); Zhao, Sun, Toh 2010 (proximal semismooth Newton); Kanzow,
// Ferenczi, Fukushima 2009 (the projection on second-order cones).
#include "amontons/solvers/second_order/newton.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/elementary.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "solvers/second_order/policy.hpp"

namespace amontons {

namespace {

using Vector = std::vector<double>;

// R = P^-1/2 V sqrt(q / (1 - q + sigma q)) with Q = V diag(q) V', row-major.
template <int n>
void face_factor(const Face<n>& face, double p, double sigma, double* R) {
  for (int k = 0; k < n; ++k) {
    const double q = face.value[k], weight = std::sqrt(q / ((1 - q + sigma * q) * p));
    for (int i = 0; i < n; ++i) R[n * i + k] = weight * face.vector[k][i];
  }
}

// out = Q d
template <int n>
void apply(const Face<n>& face, const double* d, double* out) {
  std::fill(out, out + n, 0.0);
  for (int k = 0; k < n; ++k) {
    double along = 0;
    for (int i = 0; i < n; ++i) along += face.vector[k][i] * d[i];
    along *= face.value[k];
    for (int i = 0; i < n; ++i) out[i] += along * face.vector[k][i];
  }
}

// The linear algebra of one Newton step. Under coulomb g = u + s(u) e_n with s = mu |u_t|. Its derivative is
// B A with B = I + e_n s'(u)' per contact, and the equation (I - Q + Q P^-1 B A) dx = -F is unsymmetric.
// GMRES (Saad, Schultz 1986) solves it, preconditioned by the symmetric system with B = I. The two differ
// only in the normal rows of sliding contacts, so that few basis vectors suffice.
class NewtonStep {
 public:
  NewtonStep(const Problem& problem, Law law) : problem_(problem), law_(law), system_(problem) {
    R_.resize(system_.factor_size());
    for (Vector* v : {&F_, &work_, &Av_, &y_}) v->resize(problem.rows());
    if (law != Law::coulomb) return;
    basis_.assign(second_order::krylov + 1, F_);
    image_.assign(second_order::krylov, F_);
  }

  // dx at (x, u = A x + b).
  void direction(const Vector& x, const Vector& u, double sigma, Vector& dx, Monitor& monitor) {
    sigma_ = sigma;
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double g[S::dim], foot[S::dim];
      double* y = &y_[row];
      add_de_saxce_term(set, law_, &u[row], g);
      for (int k = 0; k < S::dim; ++k) y[k] = x[row + k] - g[k] / problem_.P[block];
      set.project(y, foot);
      for (int k = 0; k < S::dim; ++k) F_[row + k] = foot[k] - x[row + k];
      face_factor(set.face(y), problem_.P[block], sigma, &R_[system_.factor_offset(block)]);
    });
    system_.factor(R_);
    monitor.count_factorization(system_.factor_work());
    if (law_ == Law::coulomb)
      gmres(u, dx, monitor);
    else
      solve_symmetric(F_, dx, 1, monitor);
  }

 private:
  // y = (I - Q + sigma Q + Q P^-1 A)^-1 r: y = r + R zeta, (I + R'AR) zeta = R' ((1 - sigma) P r - A r).
  void solve_symmetric(const Vector& r, Vector& y, int refinements, Monitor& monitor) {
    product(problem_.A, r, work_);
    for_each_block(problem_.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      for (int k = 0; k < S::dim; ++k)
        work_[row + k] = (1 - sigma_) * problem_.P[block] * r[row + k] - work_[row + k];
    });
    system_.solve(work_, y, refinements);
    for (std::size_t i = 0; i < y.size(); ++i) y[i] += r[i];
    monitor.products += 2 + refinements;
  }

  // out = (I - Q + Q P^-1 B A) v
  void apply_derivative(const Vector& u, const Vector& v, Vector& out, Monitor& monitor) {
    product(problem_.A, v, Av_);
    ++monitor.products;
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      double d[S::dim], Qd[S::dim];
      for (int k = 0; k < S::dim; ++k) d[k] = Av_[row + k];
      if constexpr (S::frictional) {
        double slope[S::dim], more = 0;
        set.de_saxce_gradient(&u[row], slope);
        for (int k = 0; k < S::dim; ++k) more += slope[k] * d[k];
        d[0] += more;
      }
      for (int k = 0; k < S::dim; ++k) d[k] = d[k] / problem_.P[block] - v[row + k];
      amontons::apply(set.face(&y_[row]), d, Qd);
      for (int k = 0; k < S::dim; ++k) out[row + k] = v[row + k] + Qd[k];
    });
  }

  // In the P metric entries of blocks of any mass have equal weight.
  double dot(const Vector& a, const Vector& b) const {
    double sum = 0;
    for_each_block(problem_.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      for (int k = 0; k < S::dim; ++k) sum += problem_.P[block] * a[row + k] * b[row + k];
    });
    return sum;
  }

  // Solves J dx = -F, J = I - Q + Q P^-1 B A. Arnoldi with modified Gram-Schmidt builds an orthonormal basis
  // v_k with J z_k = sum_j H_jk v_j. The preconditioned vectors z_k = C^-1 v_k are stored, so that each is
  // formed once. Givens rotations bring H to a triangle column by column. |rhs_k| is then the residual of the
  // best combination of the first k, and dx = sum y_k z_k. Right preconditioning makes this residual the true
  // one. There is no restart.
  void gmres(const Vector& u, Vector& dx, Monitor& monitor) {
    double H[second_order::krylov + 1][second_order::krylov], c[second_order::krylov],
        s[second_order::krylov], rhs[second_order::krylov + 1] = {};
    const double norm = std::sqrt(dot(F_, F_));
    std::fill(dx.begin(), dx.end(), 0.0);
    if (!(norm > 0)) return;
    for (std::size_t i = 0; i < dx.size(); ++i) basis_[0][i] = F_[i] / norm;
    rhs[0] = norm;
    int k = 0;
    while (k < second_order::krylov && std::abs(rhs[k]) > second_order::policy.inexact * norm &&
           !monitor.out_of_time()) {
      solve_symmetric(basis_[k], image_[k], 0, monitor);
      Vector& next = basis_[k + 1];
      apply_derivative(u, image_[k], next, monitor);
      for (int j = 0; j <= k; ++j) {
        H[j][k] = dot(next, basis_[j]);
        for (std::size_t i = 0; i < next.size(); ++i) next[i] -= H[j][k] * basis_[j][i];
      }
      H[k + 1][k] = std::sqrt(dot(next, next));
      if (H[k + 1][k] > 0)
        for (double& v : next) v /= H[k + 1][k];
      for (int j = 0; j < k; ++j) {
        const double a = H[j][k], b = H[j + 1][k];
        H[j][k] = c[j] * a + s[j] * b;
        H[j + 1][k] = -s[j] * a + c[j] * b;
      }
      const double rho = elementary::hypot(H[k][k], H[k + 1][k]);
      if (!(rho > 0)) break;
      c[k] = H[k][k] / rho;
      s[k] = H[k + 1][k] / rho;
      H[k][k] = rho;
      rhs[k + 1] = -s[k] * rhs[k];
      rhs[k] *= c[k];
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
  // F_ holds -F, y_ the point x - P^-1 g whose projection determines the faces.
  Vector R_, F_, work_, Av_, y_;
  std::vector<Vector> basis_, image_;
};

// If a Newton step does not reduce the residual, P-SPG-FB continues for a while.
class Newton : public VectorIterate {
 public:
  static constexpr const char* name = "newton";
  static constexpr Limits limits{1000, 60, 0};  // not tuned: defaults

  using VectorIterate::VectorIterate;

  double start(const Start& s) {
    newton_.emplace(problem, law_of(problem, options));
    map_ = VectorIterate::start(s);
    for (Vector* v : {&dx_, &trial_, &trial_u_}) v->resize(x.size());
    return map_;
  }

  std::optional<double> step() {
    newton_->direction(x, u, second_order::policy.rounding, dx_, monitor);
    if (!search()) first_order_phase();
    return map_;
  }

 private:
  // Finds the first of the steps 1, 1/2, ... that reduces the residual. Trial points are projected, because
  // dx respects faces and not cones. If it returns true, x, u and the natural map are those of that step.
  bool search() {
    for (int k = 0; k <= second_order::policy.halvings; ++k) {
      const double t = std::ldexp(1.0, -k);
      for (std::size_t i = 0; i < x.size(); ++i) trial_[i] = x[i] + t * dx_[i];
      project(problem.K, trial_, trial_);
      const double map = amontons::evaluate(problem, law_of(problem, options), trial_, trial_u_, monitor);
      if (!(map < map_)) continue;
      x.swap(trial_);
      u.swap(trial_u_);
      map_ = map;
      return true;
    }
    return false;
  }

  // The fallback of P-SPG-FB ensures that the burst never ends above its start. Its iterations count as one
  // of this method, its products one by one. The caller's limits, clock and interrupt apply inside.
  void first_order_phase() {
    Options o = options;
    o.x0 = x;
    o.max_iterations = second_order::policy.burst;
    o.history = false;
    o.callback = nullptr;
    Solution s = spg(problem, o, monitor.budget());
    monitor.products += s.products;
    if (s.status == Status::interrupted) monitor.interrupt();
    x = std::move(s.x);
    map_ = evaluate();
  }

  std::optional<NewtonStep> newton_;
  // The natural map at x.
  double map_ = 0;
  Vector dx_, trial_, trial_u_;
};

}  // namespace

std::unique_ptr<Run> start_newton(const Problem& problem, const Options& options, Budget& budget) {
  return drive<Newton>(problem, options, budget);
}

Solution newton(const Problem& problem, const Options& options, Budget& budget) {
  return complete(start_newton(problem, options, budget));
}

}  // namespace amontons
