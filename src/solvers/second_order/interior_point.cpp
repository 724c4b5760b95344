// Primal-dual interior point with Nesterov-Todd scaling and Mehrotra's predictor-corrector for
//
//     u = A x + b,  x in K,  u in K*,  x o u = 0,
//
// o the Jordan product of the sets. The central path replaces 0 by mu e, e the unit of that product. For
// every mu > 0 it has a point (x, u) inside K and K*, and for mu -> 0 this tends to a solution. A step aims
// at a smaller mu with Newton's method. The Nesterov-Todd scaling is the symmetric W with W x = W^-1 u =
// lambda. In scaled coordinates both iterates are equal, and the linearised path is, docs/algorithm.md (25),
//
//     A dx - du = -(A x + b - u),   lambda o (W dx + W^-1 du) = mu e - lambda o lambda - (second-order term).
//
// Eliminating du leaves (A + W^2) dx = r for ShiftedSystem: in body space that is a sparse Cholesky
// factorisation with six unknowns per body. The contribution of a block is the Barrier of its set
// (sets/barrier.hpp). In its units the block's mean of diag(A), and the natural map at zero, are of order
// one:
//
//     x = unit x~,   u = (beta^2 / unit) u~,   unit = beta / sqrt(P),   so that <x, u> = beta^2 <x~, u~>.
//
// Under coulomb the path of the law itself takes its place (coulomb_path.cpp).
//
// Sources: Nesterov, Todd 1997; Mehrotra 1992; Vandenberghe 2010 for the algebra and the start.
#include "amontons/solvers/second_order/interior_point.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/policy.hpp"
#include "amontons/sets/barriers.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "solvers/second_order/coulomb_path.hpp"
#include "solvers/second_order/policy.hpp"

namespace amontons {

namespace {

using Vector = std::vector<double>;

// A smaller scale would underflow when squared: b and the natural map at zero vanish, and x~ = x is used.
constexpr double smallest_scale = 1e-145;  // not tuned: the root of the smallest number

// Share of the distance to the boundary that a full step leaves.
double margin() { return 1 - second_order::policy.fraction; }

class InteriorPoint : public VectorIterate {
 public:
  static constexpr const char* name = "interior-point";
  static constexpr Limits limits{200, 30, 0};  // not tuned: defaults, options may set others

  using VectorIterate::VectorIterate;
  double start(const Start&);
  std::optional<double> step();

 private:
  // Calls f(barrier, block, row) for every block, with dim as template parameter.
  template <class F>
  void each(F&& f) {
    barriers_.each(problem.K, [&]<class S>(const S&, auto& barrier, std::size_t block, std::size_t row) {
      f.template operator()<S::dim>(barrier, block, row);
    });
  }
  void make_barriers();
  void scale_blocks(auto&& scale);
  void factor();
  void solve(double target, bool corrector, int refinements);
  void form_x();
  double longest_step();
  double gap(double t);

  std::optional<ShiftedSystem> system_;
  // The iterate (x~, u~) and the last direction. The x of VectorIterate is that of the barriers. Its u = A x
  // + b differs from the dual iterate and agrees with it only in the limit.
  Barriers barriers_;
  // scale_, map_: the natural map at zero and at the iterate. beta_: scale_ per block. degree_: number of
  // complementarity products.
  double beta_ = 1, degree_ = 0, scale_ = 1, map_ = 0;
  // Per block: unit of x (N s).
  Vector unit_;
  Vector z_, rho_, R_;
};

void InteriorPoint::make_barriers() {
  scale_ = natural_map_at_zero(problem, law_of(problem, options));
  beta_ = scale_ / std::sqrt(std::max<double>(1, problem.K.blocks()));
  if (beta_ < smallest_scale) beta_ = 1;
  for (double p : problem.P) unit_.push_back(beta_ / std::sqrt(p));
  barriers_.make(problem.K, unit_);
  each([&]<int dim>(auto& barrier, std::size_t, std::size_t) { degree_ += barrier.degree(); });
}

// R of the shifted system from the R~ of each block: Theta^-1 = (beta / unit)^2 W^2.
void InteriorPoint::scale_blocks(auto&& scale) {
  each([&]<int dim>(auto& barrier, std::size_t block, std::size_t) {
    double* R = &R_[system_->factor_offset(block)];
    scale(barrier, R);
    const double unit_R = unit_[block] / beta_;
    for (int k = 0; k < dim * dim; ++k) R[k] *= unit_R;
  });
}

void InteriorPoint::factor() {
  system_->factor(R_);
  monitor.count_factorization(system_->factor_work());
}

// Start: the solution of the problem without inequalities but with a unit proximal term, min 1/2 <x, A x + 2
// b> + 1/2 |x~|^2, pushed into the interior. Its condition is u~ = -x~, so x~ and u~ cannot both lie inside.
// Adding more_x e and more_u e brings them inside. This start includes the balance of the stresses. A given
// x0 mostly lies on the boundary of K, where the scaling does not exist.
double InteriorPoint::start(const Start&) {
  system_.emplace(problem);
  const std::size_t m = problem.rows();
  for (Vector* v : {&x, &u, &z_, &rho_}) v->assign(m, 0.0);
  R_.resize(system_->factor_size());
  make_barriers();
  scale_blocks([](auto& barrier, double* R) { barrier.start_factor(R); });
  factor();
  form_x();
  evaluate();
  for (std::size_t i = 0; i < m; ++i) z_[i] = -u[i];
  system_->solve(z_, z_, 1);
  double low_x = INFINITY, low_u = INFINITY;  // the smallest eigenvalues of x~ and of u~ = -x~
  each([&]<int dim>(auto& barrier, std::size_t block, std::size_t row) {
    double part[dim];
    for (int k = 0; k < dim; ++k) part[k] = z_[row + k] / unit_[block];
    barrier.start(part);
    barrier.worst(low_x, low_u);
  });
  // No start is nearer to the boundary than a step may end.
  const double more_x = low_x < margin() ? 1 - low_x : 0, more_u = low_u < margin() ? 1 - low_u : 0;
  each([&]<int dim>(auto& barrier, std::size_t, std::size_t) { barrier.push(more_x, more_u); });
  form_x();
  return map_ = evaluate();
}

void InteriorPoint::form_x() {
  each([&]<int dim>(auto& barrier, std::size_t block, std::size_t row) {
    barrier.primal(&x[row]);
    for (int k = 0; k < dim; ++k) x[row + k] *= unit_[block];
  });
}

// The direction for
//
//     lambda o (W dx~ + W^-1 du~) = target e - lambda o lambda - (the affine second-order term),
//     A dx - du = -(A x + b - u).
//
// With rho = lambda \ (right-hand side of the first) and z = W dx~ the first says du~ = W (rho - z). Put into
// the second, and multiplied by R' = (unit / beta) W^-1, that is
//
//     (I + R'AR) beta z = -R'(A x + b - u) + beta rho.
//
// Solving for z keeps both steps accurate where W or its inverse is huge.
void InteriorPoint::solve(double target, bool corrector, int refinements) {
  each([&]<int dim>(auto& barrier, std::size_t block, std::size_t row) {
    barrier.target(target, corrector, &rho_[row]);
    double dual[dim];
    barrier.dual(dual);
    for (int k = 0; k < dim; ++k) z_[row + k] = beta_ * beta_ / unit_[block] * dual[k] - u[row + k];
  });
  system_->times_transposed_factor(z_, z_);
  for (std::size_t i = 0; i < z_.size(); ++i) z_[i] += beta_ * rho_[i];
  system_->solve_reduced(z_, z_, refinements);
  monitor.products += 1 + refinements;
  for (double& v : z_) v /= beta_;
  each([&]<int dim>(auto& barrier, std::size_t, std::size_t row) { barrier.recover(target, &z_[row]); });
}

// The largest t, equal for all blocks and both iterates. The step then also solves the linear equation: the
// infeasibility A x + b - u shrinks by the factor 1 - t.
double InteriorPoint::longest_step() {
  double t = 1e30;  // not tuned: beyond every step
  each([&]<int dim>(auto& barrier, std::size_t, std::size_t) { t = std::min(t, barrier.longest_step()); });
  return t;
}

// The complementarity <x, u> / degree at x + t dx, u + t du.
double InteriorPoint::gap(double t) {
  double sum = 0;
  each([&]<int dim>(auto& barrier, std::size_t, std::size_t) { sum += barrier.gap(t); });
  return sum / std::max(1.0, degree_);
}

std::optional<double> InteriorPoint::step() {
  // Rounding ends the central path: the residual jumps by more than a full step takes away, or the step
  // collapses. It comes from an iterate squeezed against the boundary then, as later ones would.
  if (margin() * map_ / scale_ > std::max(monitor.best(), base::policy.rounding)) return std::nullopt;
  scale_blocks([](auto& barrier, double* R) { barrier.factor(R); });
  factor();
  // Predictor: the affine step to mu = 0. It gives the reduction of mu, sigma = (its gap over the present
  // gap)^3 (Mehrotra), and the second-order term that the linearisation dropped.
  const double mu = gap(0);
  solve(0, false, 0);
  const double affine = std::min(1.0, longest_step());
  const double ratio = mu > 0 ? std::clamp(gap(affine) / mu, 0.0, 1.0) : 0.0;
  // Corrector: to sigma mu, with that term, by the same factorisation. It is the final step, so it is refined
  // once.
  solve(ratio * ratio * ratio * mu, true, 1);
  const double t = std::min(1.0, second_order::policy.fraction * longest_step());
  if (!(t > margin())) return std::nullopt;
  each([&]<int dim>(auto& barrier, std::size_t, std::size_t) { barrier.move(t); });
  form_x();
  return map_ = evaluate();
}

}  // namespace

std::unique_ptr<Run> start_central_path(const Problem& problem, const Options& options, Budget& budget) {
  return law_of(problem, options) == Law::coulomb && problem.K.has_friction()
             ? start_coulomb_path(problem, options, budget)
             : drive<InteriorPoint>(problem, options, budget);
}

}  // namespace amontons
