// Accelerated projected gradient descent in the P metric with adaptive step and restart. Sources: Nesterov
// 1983; Mazhar, Heyn, Tasora, Negrut, "Using Nesterov's method to accelerate multibody dynamics with friction
// and contact", ACM TOG 2015; O'Donoghue, Candes 2015 (restart). A step d from y is accepted on the curvature
// d'Ad <= L d'Pd, not on objective values, which stop being comparable near rounding.
#include "amontons/solvers/first_order/apgd.hpp"

#include <algorithm>
#include <cmath>

#include "solvers/first_order/choose_iterate.hpp"

namespace amontons {

namespace {

constexpr double relaxation = 0.95;  // of L after every step

template <Iterate T>
class Apgd {
 public:
  static constexpr const char* name = "apgd";
  static constexpr Limits limits{100000, 10000, 100};

  Apgd(Monitor& monitor, T iterate) : monitor_(monitor), iterate_(std::move(iterate)) {}

  double start(const Start& s) {
    const double residual_squared = iterate_.start(s.x);
    ++monitor_.products;
    iterate_.start_momentum();
    return std::sqrt(residual_squared);
  }

  std::optional<double> step() {
    // d := Pi_K(y - P^-1 g(y) / L) - y, L raised until it bounds the curvature along d
    MomentumDirection d;
    for (;;) {
      d = iterate_.momentum_direction(1 / L_);
      const double dAd = iterate_.curvature();
      ++monitor_.products;
      require_curvature(dAd, d.dPd);
      if (dAd <= L_ * d.dPd || !(d.dPd > 0)) break;
      L_ = std::max(2 * L_, dAd / d.dPd);
    }
    // x+ := y + d;  y := x+ + beta (x+ - x). Where <y - x+, x+ - x> > 0 in the P metric the momentum points
    // uphill: it is dropped, and builds up anew.
    const bool uphill = -(d.dPd + d.dPm) > 0;
    const double theta_next = 0.5 * theta_ * (std::sqrt(theta_ * theta_ + 4) - theta_);
    const double beta = uphill ? 0.0 : theta_ * (1 - theta_) / (theta_ * theta_ + theta_next);
    theta_ = uphill ? 1.0 : theta_next;
    L_ *= relaxation;
    return std::sqrt(iterate_.accelerate(beta));
  }

  // Both x and y, or the momentum would amplify the difference of their rounding errors.
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
  double L_ = 1, theta_ = 1;
};

}  // namespace

Solution apgd(const Problem& problem, const Options& options) {
  return with_iterate(problem, options, [&]<class T>(T iterate) {
    Monitor monitor(options, Apgd<T>::limits);
    return drive(problem, options, Apgd<T>(monitor, std::move(iterate)), monitor);
  });
}

}  // namespace amontons
