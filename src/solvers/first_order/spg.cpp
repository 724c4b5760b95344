// P-SPG-FB, production variant (DESIGN of the literal one: spg_literal.cpp). Sources: Tasora 2013 (fallback,
// preconditioner), Birgin, Martinez, Raydan 2000 (nonmonotone spectral projected gradient), Fletcher 2005
// (alternating Barzilai-Borwein steps). It differs from the literal variant in what costs time or robustness:
//  - one product per iteration: f is an exact quadratic along d, so the line search needs only <d,g> and
//  d'Ad;
//  - objective differences are summed instead of comparing objective values, which stalls at rounding;
//  - the fallback measure is the residual itself, free from the fused third pass;
//  - u is recomputed from scratch now and then, and before convergence is declared.
#include <algorithm>
#include <cmath>

#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/plain_iterate.hpp"
#include "amontons/solvers/solvers.hpp"

namespace amontons {

namespace {

constexpr std::size_t refresh_period = 100;
constexpr int max_backtracks = 60;

// The objective relative to the start, and the maximum that bounds the next step: over f_{j-i}, i = 0..min(j,
// N_GLL), as the paper has it, so that N_GLL + 1 values are kept; those before the start are -inf.
class Envelope {
 public:
  explicit Envelope(std::size_t N_GLL) : values_(N_GLL + 1, -INFINITY) { values_[0] = 0; }
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

// lambda of the nonmonotone test f(x + lambda d) <= max f + gamma lambda <d, g>; f(x + lambda d) - f(x) =
// lambda <d,g> + lambda^2/2 d'Ad, whose interpolant has its minimum at -<d,g> / d'Ad.
double line_search(const SpgOptions& o, const Envelope& f, double dg, double dAd, std::size_t& backtracks) {
  const double room = f.maximum() - f.current(), exact = -dg / dAd;
  double lambda = 1;
  for (backtracks = 0; backtracks < max_backtracks; ++backtracks) {
    if (lambda * dg + 0.5 * lambda * lambda * dAd <= room + o.gamma * lambda * dg) break;
    lambda = std::clamp(exact, o.sigma_min * lambda, o.sigma_max * lambda);
  }
  return lambda;
}

template <class Iterate>
Solution run(const Problem& problem, const Options& options, Iterate iterate) {
  const SpgOptions& o = options.spg;
  Monitor monitor(options, 100000, 10000);
  const double scale = natural_map_at_zero(problem, options.law);
  std::vector<double> x(problem.rows()), u(problem.rows());
  starting_point(problem, options, x, u, monitor);

  double r = std::sqrt(iterate.start(x)) / scale;
  ++monitor.products;
  const double f0 = iterate.objective();
  Envelope f(o.memory);
  double alpha = 1;
  std::size_t backtracks = 0, since_refresh = 0;
  Status status;
  for (std::size_t j = 0;; ++j) {
    if (since_refresh >= refresh_period || (r <= options.tolerance && since_refresh > 0)) {
      r = std::sqrt(iterate.refresh()) / scale;
      ++monitor.products;
      since_refresh = 0;
    }
    const auto stop = monitor.observe(r, f0 + f.current(), alpha, backtracks);
    if (monitor.improved()) iterate.keep_best();
    if (stop) {
      status = *stop;
      break;
    }
    const Direction d = iterate.direction(alpha);
    // d is a projection in the P metric, so <d,g> <= -<d,Pd> / alpha. The sum <d,g> itself drowns in rounding
    // once |d|^2 falls below eps |x| |u|; the bound does not, and carries the iteration on to the last
    // digits.
    const double dg = std::min(d.dg, -d.dPd / alpha);
    if (!(dg < 0)) {  // d = 0: stationary to the last bit
      status = Status::stalled;
      break;
    }
    const double dAd = iterate.curvature();
    require_curvature(dAd, d.dPd);
    const double lambda = line_search(o, f, dg, dAd, backtracks);
    const Update s = iterate.update(lambda);
    ++monitor.products;
    ++since_refresh;
    f.add(lambda * dg + 0.5 * lambda * lambda * dAd);
    const double sPs = lambda * lambda * d.dPd;
    const double next = s.sy > 0 ? (j % 2 ? sPs / s.sy : s.sy / s.yPy) : 2 * alpha;
    alpha = std::clamp(next, o.alpha_min, o.alpha_max);
    r = std::sqrt(s.residual_squared) / scale;
  }
  iterate.extract_best(x);
  return finish(problem, options, "p-spg-fb", std::move(x), status, monitor);
}

}  // namespace

Solution spg(const Problem& problem, const Options& options) {
  return std::visit(
      [&]<class Op>(const Op& A) {
        if constexpr (std::is_same_v<Op, ContactOperator>)
          return run(problem, options,
                     ContactIterate(A, problem.K, problem.b, problem.P, options.law, options.threads));
        else
          return run(problem, options, PlainIterate<Op>(A, problem, options.law));
      },
      problem.A);
}

}  // namespace amontons
