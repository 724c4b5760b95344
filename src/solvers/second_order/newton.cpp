// Semismooth Newton on the equations F(x, u) = 0 of all blocks (block_equation.hpp), u = A x + b, globalised
// by P-SPG-FB.
//
// Equation. F is zero exactly at a solution and piecewise smooth. With dF = G dx + H du a step solves,
// docs/algorithm.md (24),
//
//     (G + H (A + sigma P)) dx = -F.
//
// A block at a bound has H = 0: x moves to it. One that sticks has G = 0: u vanishes. So each cone
// contributes its face: 3 unknowns when sticking, 2 when sliding, 0 when open. Once the faces are right the
// step is that of a linear system. Convergence is fast near a solution; far away there is no guarantee.
//
// The proximal term keeps the system regular if A is singular (hyperstatic contacts). It affects only the
// step: dx = 0 still means F = 0. It is of the order of rounding, so that the convergence stays superlinear.
//
// One factorisation. With N = G + H P, f = N^-1 F, R = N^-1 H the step is dx = -f + R z, and
//
//     (J + A R) z = A f - (1 - sigma) P f,   J = I - (1 - sigma) P R,
//
// the system of ShiftedSystem without symmetry.
//
// Sources: Qi, Sun 1993 (semismooth Newton); Alart, Curnier 1991 (the equations of Coulomb's law); Zhao, Sun,
// Toh 2010 (proximal semismooth Newton); Kanzow, Ferenczi, Fukushima 2009 (the projection on second-order
// cones).
#include "amontons/solvers/second_order/newton.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/policy.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "solvers/linear/small_solve.hpp"
#include "solvers/second_order/block_equation.hpp"
#include "solvers/second_order/policy.hpp"

namespace amontons {

namespace {

using Vector = std::vector<double>;

// The linear algebra of one Newton step.
class NewtonStep {
 public:
  NewtonStep(const Problem& problem, Law law) : problem_(problem), law_(law), system_(problem) {
    for (Vector* v : {&R_, &J_}) v->resize(system_.factor_size());
    for (Vector* v : {&f_, &q_}) v->resize(problem.rows());
  }

  // dx at (x, u = A x + b).
  void direction(const Vector& x, const Vector& u, double sigma, Vector& dx, Monitor& monitor) {
    for_each_block(problem_.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
      const std::size_t factor = system_.factor_offset(block);
      linearise(set, {problem_.P[block], &x[row], &u[row]}, sigma, &f_[row], &R_[factor], &J_[factor]);
    });
    system_.factor(R_, J_);
    monitor.count_factorization(system_.factor_work());
    product(problem_.A, f_, q_);
    for_each_block(problem_.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      for (std::size_t i = row; i < row + S::dim; ++i) q_[i] -= (1 - sigma) * problem_.P[block] * f_[i];
    });
    system_.solve_reduced(q_, q_, refinements);
    system_.times_factor(q_, dx);
    for (std::size_t i = 0; i < dx.size(); ++i) dx[i] -= f_[i];
    monitor.products += 2 + refinements;
  }

 private:
  // A contact that sticks has the pivot sigma P, with which digits cancel (ShiftedSystem); one step of
  // refinement brings them back.
  static constexpr int refinements = 1;

  // f, R and J of a block.
  template <class S>
  void linearise(const S& set, const BlockPoint& at, double sigma, double* f, double* R, double* J) const {
    constexpr std::size_t d = S::dim, width = d + 1;
    double F[d], G[d * d], H[d * d], X[d * width];
    block_equation(set, law_, at, {F, G, H});
    for (std::size_t i = 0; i < d; ++i) {
      X[width * i] = F[i];
      for (std::size_t j = 0; j < d; ++j) {
        X[width * i + 1 + j] = H[d * i + j];
        G[d * i + j] += at.p * H[d * i + j];
      }
    }
    solve_block(d, G, X, width);
    for (std::size_t i = 0; i < d; ++i) {
      f[i] = X[width * i];
      for (std::size_t j = 0; j < d; ++j) {
        R[d * i + j] = X[width * i + 1 + j];
        J[d * i + j] = (i == j) - (1 - sigma) * at.p * R[d * i + j];
      }
    }
  }

  const Problem& problem_;
  Law law_;
  ShiftedSystem system_;
  Vector R_, J_, f_, q_;
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
    newton_->direction(x, u, base::policy.rounding, dx_, monitor);
    if (!search()) first_order_phase();
    return map_;
  }

 private:
  // Finds the first of the steps 1, 1/2, ... that reduces the residual, down to three digits. Trial points
  // are projected, because dx respects faces and not cones. If it returns true, x, u and the natural map are
  // those of that step.
  bool search() {
    for (double t = 1; t > base::policy.three_digits; t *= 0.5) {
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
