// P-SPG-FB, the preconditioned spectral projected gradient method with fallback: A. Tasora, "Efficient
// simulation of contacts, friction and constraints using a modified spectral projected gradient method", WSCG
// 2013. It minimises f(x) = 1/2 x'Ax + b'x over K along projected gradients in the metric of the diagonal P.
// It uses the step lengths of Barzilai and Borwein and a nonmonotone line search (Birgin, Martinez, Raydan
// 2000):
//
//  x_0 := Pi_K(x_0);  x_FB := x_0;  g_0 := A x_0 + b;  alpha_0 := 1
//  for j = 0 ..
//    1.  p := P^-1 g_j;  d := Pi_K(x_j - alpha_j p) - x_j
//    2.  <d, g_j> must be negative
//    3.  lambda := 1; while f(x_j + lambda d) > max_i f_j-i + gamma lambda <d, g_j>, i = 0 .. min(j, N_GLL),
//        lambda := the minimum of the parabola through f, within [sigma_min lambda, sigma_max lambda]
//    4.  x_j+1 := x_j + lambda d;  g_j+1 := g_j + lambda A d;  s := x_j+1 - x_j;  y := g_j+1 - g_j
//    5.  alpha_j+1 := <s,Ps> / <s,y> for odd j, <s,y> / <y,P^-1 y> for even j
//    6.  w := | x_j+1 - Pi_K(x_j+1 - P^-1 g_j+1) |_P;  the smallest w so far makes x_j+1 the x_FB
//
// companions/spg_literal.cpp has the algorithm unchanged. This variant differs where that costs time or
// robustness:
//  - one product per iteration: f is an exact quadratic along d, f(x + lambda d) - f(x) = lambda <d,g> +
//    lambda^2/2 d'Ad, so that the line search needs no further product;
//  - these differences are summed instead of comparing objective values, which stalls at rounding;
//  - the fallback keeps the iterate with the smallest natural residual, which the third pass yields at no
//    cost;
//  - u is formed from scratch at intervals, and before convergence is declared.
// Under coulomb g = u + s(u) e_n follows u in every iteration: one loop, no nested solves. f is then only a
// model, with the De Saxce term frozen at each x_j; the residual decides.
#include "amontons/solvers/first_order/spg.hpp"

#include <algorithm>
#include <cmath>

#include "solvers/first_order/choose_iterate.hpp"

namespace amontons {

namespace {

// A trial shrinks at least by sigma_max = 0.9: 60 of them are a factor below 2e-3, and 1e-60 with sigma_min.
// With gamma below 1/2 the minimum along d is itself accepted, so few are needed. At the limit the last step
// is taken: x stays in K for any lambda in [0, 1].
constexpr int max_backtracks = 60;

// The objective relative to the start, and its largest value over the window of the nonmonotone test,
// f_j-i for i = 0 .. min(j, N_GLL) (Grippo, Lampariello, Lucidi 1986): N_GLL + 1 values.
class Envelope {
 public:
  // A ring. Unwritten values are -infinity, which never is the maximum: min(j, N_GLL) needs no counter.
  explicit Envelope(std::size_t memory) : values_(memory + 1, -INFINITY) { values_[0] = 0; }
  double current() const { return f_; }
  double maximum() const { return *std::max_element(values_.begin(), values_.end()); }
  void add(double difference) {
    f_ += difference;
    values_[++count_ % values_.size()] = f_;
  }

 private:
  std::vector<double> values_;
  std::size_t count_ = 0;
  double f_ = 0;
};

struct SpgKind {
  static constexpr const char* name = "p-spg-fb";
  static constexpr Limits limits{100000, 10000, 100};
  static constexpr std::size_t refresh_products = 1;
  static constexpr bool sums_objective = true;
  static AnyMethod::Settings settings(const Options& options) {
    const SpgOptions& o = options.spg;
    return {{"alpha", 1},
            {"alpha_min", o.alpha_min},
            {"alpha_max", o.alpha_max},
            {"sigma_min", o.sigma_min},
            {"sigma_max", o.sigma_max},
            {"gamma", o.gamma},
            {"memory", static_cast<double>(o.memory + 1)}};
  }
};

template <Iterate T>
class Spg {
 public:
  static constexpr const char* name = SpgKind::name;
  static constexpr Limits limits = SpgKind::limits;

  Spg(const Options& options, Monitor& monitor, T iterate)
      : options_(options.spg), monitor_(monitor), iterate_(std::move(iterate)), f_(options.spg.memory) {}

  // x_0 := Pi_K(x_0), g_0 := A x_0 + b, alpha_0 := 1. In the metric of P the first step has the length of a
  // Jacobi step.
  double start(const Start& s) {
    const double residual_squared = iterate_.start(s.x);
    ++monitor_.products;
    f0_ = iterate_.objective();
    return std::sqrt(residual_squared);
  }

  std::optional<double> step() {
    // 1. docs/algorithm.md (17): p := P^-1 g_j;  d := Pi_K(x_j - alpha_j p) - x_j
    const Direction d = iterate_.direction(alpha_);
    // 2. Descent. d is a projection in the P metric, hence <d,g> <= -<d,Pd> / alpha. The sum <d,g> itself is
    // lost in rounding once |d|^2 falls below eps |x| |u|. The bound is not, and remains valid to the last
    // digits.
    const double dg = std::min(d.dg, -d.dPd / alpha_);
    if (!(dg < 0)) return std::nullopt;  // d = 0: stationary to the last bit
    // 3. docs/algorithm.md (19): lambda, the first trial with f(x_j + lambda d) <= max f_j-i + gamma lambda
    // <d,g>
    const double dAd = iterate_.curvature();
    ++monitor_.products;
    require_curvature(dAd, d.dPd);
    const double lambda = line_search(dg, dAd);
    // 4. x_j+1 := x_j + lambda d;  g_j+1 := g_j + lambda A d;  s := x_j+1 - x_j;  y := g_j+1 - g_j
    const Update s = iterate_.update(lambda);
    // f_j+1 = f_j + lambda <d,g> + lambda^2/2 d'Ad
    f_.add(lambda * dg + 0.5 * lambda * lambda * dAd);
    // 5. docs/algorithm.md (20): alpha_j+1 := <s,Ps> / <s,y> for odd j, <s,y> / <y,P^-1 y> for even j, within
    // [alpha_min, alpha_max]
    //    (Fletcher 2005: alternating is more robust than either formula); doubled if <s,y> <= 0.
    const double sPs = lambda * lambda * d.dPd;
    const double next = s.sy > 0 ? (odd_ ? sPs / s.sy : s.sy / s.yPy) : 2 * alpha_;
    alpha_ = std::clamp(next, options_.alpha_min, options_.alpha_max);
    odd_ = !odd_;
    // 6. w := |x_j+1 - Pi_K(x_j+1 - P^-1 g_j+1)|_P, by which the driver keeps the best x: the fallback x_FB
    return std::sqrt(s.residual_squared);
  }

  double refresh() {
    ++monitor_.products;
    return std::sqrt(iterate_.refresh());
  }
  void keep_best() { iterate_.keep_best(); }
  void best(std::vector<double>& x) const { iterate_.extract_best(x); }
  void last(std::vector<double>& x) const { iterate_.extract(x); }
  double objective() const { return f0_ + f_.current(); }
  double step_size() const { return alpha_; }
  std::size_t backtracks() const { return backtracks_; }

 private:
  // 3. docs/algorithm.md (18): along d, f(x_j + lambda d) - f_j = lambda <d,g> + lambda^2/2 d'Ad. Its minimum
  // -<d,g> / d'Ad is the next trial, clipped to [sigma_min lambda, sigma_max lambda]. `room` is the allowed
  // rise of f over f_j.
  double line_search(double dg, double dAd) {
    const double room = f_.maximum() - f_.current(), exact = -dg / dAd;
    double lambda = 1;
    for (backtracks_ = 0; backtracks_ < max_backtracks; ++backtracks_) {
      if (lambda * dg + 0.5 * lambda * lambda * dAd <= room + options_.gamma * lambda * dg) break;
      lambda = std::clamp(exact, options_.sigma_min * lambda, options_.sigma_max * lambda);
    }
    return lambda;
  }

  const SpgOptions& options_;
  Monitor& monitor_;
  T iterate_;
  Envelope f_;
  // f0: f at the start, to which the sums of f_ are relative. alpha: the spectral step, without a unit
  // because P has it.
  double f0_ = 0, alpha_ = 1;
  std::size_t backtracks_ = 0;
  bool odd_ = false;
};

}  // namespace

std::unique_ptr<Run> start_spg(const Problem& problem, const Options& options, Budget& budget) {
  return start_over_iterate<Spg, SpgKind>(problem, options, budget);
}

Solution spg(const Problem& problem, const Options& options, Budget& budget) {
  return complete_where(start_spg(problem, options, budget), problem, options);
}

}  // namespace amontons
