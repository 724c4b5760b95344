// Accelerated projected gradient descent in the P metric with adaptive step and restart. Sources: Nesterov
// 1983; Mazhar, Heyn, Tasora, Negrut, "Using Nesterov's method to accelerate multibody dynamics with
// friction and contact", ACM TOG 2015; O'Donoghue, Candes 2015 (restart). A step d from y is accepted on the
// curvature d'Ad <= L d'Pd, not on objective values, which stop being comparable near rounding.
//
// docs/algorithm.md (21):
//
//  x_0 := Pi_K(x_0);  y_0 := x_0;  theta_0 := 1;  L := 1
//  for j = 0 ..
//    1.  d := Pi_K(y_j - P^-1 g(y_j) / L) - y_j;  while d'Ad > L d'Pd: raise L, repeat
//    2.  x_j+1 := y_j + d
//    3.  theta_j+1: the positive root of theta^2 = (1 - theta) theta_j^2
//        beta := theta_j (1 - theta_j) / (theta_j^2 + theta_j+1)
//    4.  y_j+1 := x_j+1 + beta (x_j+1 - x_j); if the momentum points uphill, y_j+1 := x_j+1, theta := 1
//
// Under coulomb g is no gradient, and momentum amplifies rotational parts of g. Residuals then rise by a
// factor in some ten iterations although no step is uphill. The momentum is therefore also dropped once the
// residual is above 1.5 times its least since the last drop. A smaller ratio helps piles of spheres and hurts
// walls (docs/decisions/methods.md); without the rule residuals stayed at 5e-2. The De Saxce term of g(y_j)
// is that of x_j, because extrapolation would amplify it too.
//
// Step 1 tests descent: f is quadratic, f(y + d) = f(y) + <g, d> + 1/2 d'Ad. So d'Ad <= L d'Pd is the upper
// model of Nesterov's proof at y + d itself. L starts at 1 because P is the mean of diag(A) of each block:
// the eigenvalues of P^-1 A have the mean 1.
#include "amontons/solvers/first_order/apgd.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "solvers/first_order/choose_iterate.hpp"

namespace amontons {

namespace {

// Without relaxation an increase by one unlucky direction would last for ever. L shrinks a little after every
// step, so that the step length follows the curvature of the current face.
constexpr double relaxation = 0.98;  // factor of L after every step
// Share by which the sums of a curvature round, added to an L that comes of them. A direction that no cone
// bounds keeps its curvature as L is raised, and would tie with the L that it gave.
constexpr double rounding = 1e-12;
// Residual over its least since the last drop of the momentum, under coulomb.
constexpr double most_rise = 1.5;

// The method for a device, which makes these iterations by kernels (on_device.hpp). A refresh takes two
// products, because u belongs to x and to the extrapolated point y.
struct ApgdKind {
  static constexpr const char* name = "apgd";
  static constexpr Limits limits{100000, 10000, 100};
  static constexpr std::size_t refresh_products = 2;
  static constexpr bool sums_objective = false;
  static AnyMethod::Settings settings(const Options&) {
    return {
        {"l", 1}, {"theta", 1}, {"relaxation", relaxation}, {"rounding", rounding}, {"most_rise", most_rise}};
  }
};

template <Iterate T>
class Apgd {
 public:
  static constexpr const char* name = ApgdKind::name;
  static constexpr Limits limits = ApgdKind::limits;

  // options.law is that of the solve: never empty.
  Apgd(const Options& options, Monitor& monitor, T iterate)
      : monitor_(monitor), iterate_(std::move(iterate)), coulomb_(options.law == Law::coulomb) {}

  double start(const Start& s) {
    const double residual_squared = iterate_.start(s.x);
    ++monitor_.products;
    iterate_.start_momentum();
    return std::sqrt(residual_squared);
  }

  std::optional<double> step() {
    // 1. d, with L raised until it bounds the curvature along d. At least doubling L ends the loop in a few
    // rounds; the quotient is the smallest L that would have accepted this d. d = 0 (y is the solution)
    // passes.
    MomentumDirection d;
    for (;;) {
      d = iterate_.momentum_direction(1 / L_);
      const double dAd = iterate_.curvature();
      ++monitor_.products;
      require_curvature(dAd, d.dPd);
      if (!(dAd > L_ * d.dPd) || !(d.dPd > 0)) break;
      L_ = std::max(2 * L_, (1 + rounding) * dAd / d.dPd);
    }
    // 3. The sums of the direction give the angle of the momentum: x_j+1 - x_j = d + (y - x), hence in the P
    // metric
    //  <y - x+, x+ - x> = -<d, d> - <d, y - x>.
    // y - x+ is the projected gradient over L. If the sum is positive, the move x+ - x goes uphill. The
    // momentum is then dropped, and builds up again from theta = 1 (the gradient scheme of O'Donoghue and
    // Candes).
    const bool uphill = -(d.dPd + d.dPm) > 0 || (coulomb_ && last_ > most_rise * least_);
    if (uphill) least_ = std::numeric_limits<double>::infinity();
    const double theta_next = 0.5 * theta_ * (std::sqrt(theta_ * theta_ + 4) - theta_);
    const double beta = uphill ? 0.0 : theta_ * (1 - theta_) / (theta_ * theta_ + theta_next);
    theta_ = uphill ? 1.0 : theta_next;
    L_ *= relaxation;
    // 2. and 4. in one pass over memory
    last_ = std::sqrt(iterate_.accelerate(beta));
    least_ = std::min(least_, last_);
    return last_;
  }

  // Refreshes x and y, because the momentum would amplify the difference of their rounding errors.
  double refresh() {
    monitor_.products += 2;
    return std::sqrt(iterate_.refresh_momentum());
  }
  void keep_best() { iterate_.keep_best(); }
  void best(std::vector<double>& x) const { iterate_.extract_best(x); }
  void last(std::vector<double>& x) const { iterate_.extract(x); }
  double objective() const { return iterate_.objective(); }
  double step_size() const { return 1 / L_; }
  std::size_t backtracks() const { return 0; }

 private:
  Monitor& monitor_;
  T iterate_;
  // L: estimate of the largest eigenvalue of P^-1 A along the steps, without a unit. theta in (0, 1]:
  // Nesterov's sequence.
  double L_ = 1, theta_ = 1;
  // The natural map of x_j, and its least since the last drop of the momentum.
  double last_ = 0, least_ = std::numeric_limits<double>::infinity();
  bool coulomb_;
};

}  // namespace

std::unique_ptr<Run> start_apgd(const Problem& problem, const Options& options, Budget& budget) {
  return start_over_iterate<Apgd, ApgdKind>(problem, options, budget);
}

Solution apgd(const Problem& problem, const Options& options, Budget& budget) {
  return complete_where(start_apgd(problem, options, budget), problem, options);
}

}  // namespace amontons
