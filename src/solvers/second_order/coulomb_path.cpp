#include "solvers/second_order/coulomb_path.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/policy.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "solvers/central_path/central_curve.hpp"
#include "solvers/central_path/curve_units.hpp"

namespace amontons {

namespace {

using Vector = std::vector<double>;

// Products of a step: its solves, one of them refined, and the natural map at its end.
constexpr std::size_t products_of_step = 3;
// The problem as a System of the central curve. The linear system of a step, divided by the roots of the
// units, is that of ShiftedSystem with J = B T.
class LargeSystem {
 public:
  explicit LargeSystem(const Problem& problem) : problem_(problem), system_(problem) {
    units_.make(problem.K, problem.b, problem.P);
    x_.resize(problem.rows());
    for (Vector* v : {&R_, &J_}) v->resize(size());
  }

  const CurveUnits& units() const { return units_; }
  std::size_t offset(std::size_t block) const { return system_.factor_offset(block); }
  std::size_t size() const { return system_.factor_size(); }
  void product(std::span<const double> x, std::span<double> u) {
    std::copy(x.begin(), x.end(), x_.begin());
    units_.to_impulses(x_);
    amontons::product(problem_.A, x_, u);
    for (std::size_t i = 0; i < u.size(); ++i) u[i] += problem_.b[i];
    units_.from_velocities(u);
  }
  // Immobile rows have R = 0 and T = 0: there J is made regular.
  int factor(std::span<const double> R, std::span<const double> BT) {
    each([&]<int n>(std::size_t block, std::size_t) {
      const double root = units_.root(block);
      for (std::size_t at = offset(block), i = 0; i < n * n; ++i, ++at) {
        const bool immobile = i % (n + 1) == 0 && R[at] == 0;
        R_[at] = root * R[at];
        J_[at] = (BT[at] + (immobile ? 1 : 0)) / root;
      }
    });
    return system_.factor(R_, J_) == 0 ? system_.sign() : 0;
  }
  double factor_work() const { return system_.factor_work(); }
  bool solve(std::span<const double> q, std::span<double> z, int refinements) {
    each([&]<int n>(std::size_t block, std::size_t row) {
      for (int i = 0; i < n; ++i) z[row + i] = q[row + i] / units_.root(block);
    });
    system_.solve_reduced(z, z, refinements);
    return std::all_of(z.begin(), z.end(), [](double v) { return std::isfinite(v); });
  }

 private:
  // Calls f(block, row), with dim as template parameter.
  template <class F>
  void each(F&& f) const {
    for_each_block(problem_.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      f.template operator()<S::dim>(block, row);
    });
  }

  const Problem& problem_;
  ShiftedSystem system_;
  CurveUnits units_;
  Vector x_, R_, J_;
};

class CoulombPath : public VectorIterate {
 public:
  static constexpr const char* name = "interior-point";
  // Limits: 200 steps, stall window 40. Where the curve turns back the residual rises for some tens of steps.
  static constexpr Limits limits{200, 40, 0};  // not tuned: defaults

  using VectorIterate::VectorIterate;
  double start(const Start&) {
    system_.emplace(problem);
    curve_.start(*system_, problem.K, law_of(problem, options));
    return evaluate_iterate();
  }
  std::optional<double> step() {
    monitor.count_factorization(system_->factor_work());
    monitor.products += products_of_step;
    if (!curve_.step() || curve_.t() < base::policy.rounding * base::policy.rounding) return std::nullopt;
    return evaluate_iterate();
  }

 private:
  double evaluate_iterate() {
    for (Vector* v : {&x, &u}) v->resize(problem.rows());
    curve_.x(x);
    system_->units().to_impulses(x);
    return evaluate();
  }

  std::optional<LargeSystem> system_;
  CentralCurve<LargeSystem> curve_;
};

}  // namespace

std::unique_ptr<Run> start_coulomb_path(const Problem& problem, const Options& options, Budget& budget) {
  return drive<CoulombPath>(problem, options, budget);
}

}  // namespace amontons
