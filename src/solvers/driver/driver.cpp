#include "amontons/solvers/driver/driver.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/base/error.hpp"
#include "amontons/problem/infeasibility.hpp"
#include "amontons/problem/threaded_product.hpp"

namespace amontons {

namespace {

// The best residual must shrink by 1 % within the stall window. A lower rate needs tens of windows per digit.
constexpr double progress = 0.99;

// Candidates for a certificate after a failed solve. If no solution exists, the iterates of a projected
// iteration differ in the limit by a constant displacement d, and this d is a certificate (Banjac, Goulart,
// Stellato, Boyd 2019). So x = x_0 + n d diverges along d, and x / |x| tends to d, best seen in the last
// iterate. d itself is the step of the natural map, Pi_K(x - P^-1 u) - x. At most three products.
bool infeasible(const Problem& problem, Law law, std::span<const double> x, std::span<const double> u,
                std::span<const double> last) {
  if (proves_infeasible(problem, law, x) || proves_infeasible(problem, law, last)) return true;
  std::vector<double> step(x.size());
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double trial[S::dim];
    for (int k = 0; k < S::dim; ++k) trial[k] = x[row + k] - u[row + k] / problem.P[block];
    set.project(trial, &step[row]);
    for (int k = 0; k < S::dim; ++k) step[row + k] -= x[row + k];
  });
  return proves_infeasible(problem, law, step);
}

// u = A x
void multiply(const Problem& problem, std::span<const double> x, std::span<double> u, unsigned threads) {
  if (const auto* system = std::get_if<ContactSystem>(&problem.A))
    product(*system, x, u, threads);
  else
    product(problem.A, x, u);
}

}  // namespace

Monitor::Monitor(const Options& options, const Limits& limits, Budget& budget)
    : options_(options),
      budget_(budget),
      start_(std::chrono::steady_clock::now()),
      limit_(options.max_iterations ? options.max_iterations : limits.iterations),
      stall_window_(limits.stall_window) {
  if (options.history) history.reserve(std::min<std::size_t>(limit_ + 1, 1 << 16));
}

std::optional<Status> Monitor::observe(double residual, double objective, double step,
                                       std::size_t backtracks) {
  // The record comes first, so that the history ends with the iterate that ended the solve. The reasons to
  // stop follow in order of precedence.
  const double now = elapsed();
  improved_ = residual < best_;
  if (improved_) best_ = residual;
  const IterationRecord record{iterations_, products, now, residual, best_, objective, step, backtracks};
  if (options_.history) history.push_back(record);
  if (residual <= options_.tolerance) return Status::converged;
  if (stopped_ || Interrupt::requested() || (options_.callback && options_.callback(record)))
    return Status::interrupted;
  if (budget_.late()) return Status::deadline;
  if (iterations_ >= limit_ || budget_.exhausted()) return Status::iteration_limit;
  // Stagnation is measured on the best residual, because the current one rises and falls.
  if (best_ <= progress * milestone_) {
    milestone_ = best_;
    last_progress_ = iterations_;
  }
  // An infinite or NaN iterate never becomes finite again.
  if (iterations_ - last_progress_ > stall_window_ || !std::isfinite(residual)) return Status::stalled;
  ++iterations_;
  return std::nullopt;
}

// P is the mean diagonal of the blocks of A, so <d, A d> / <d, P d> is the curvature relative to that of the
// axes. The rounding of a product turns zero curvature into about -1e-12 at worst; -1e-5 is far beyond that.
// Sums that overflow say nothing about A: an iterate that is no longer finite ends its method as stalled.
void require_curvature(double dAd, double dPd) {
  AMONTONS_REQUIRE(!(dAd < -1e-5 * dPd), "A is not positive semidefinite: <d, A d> = " + std::to_string(dAd) +
                                             " along a direction with <d, P d> = " + std::to_string(dPd) +
                                             "; check the signs of its rows");
}

// Not fused with the natural map: the callers do other work per iteration that costs more.
double evaluate(const Problem& problem, Law law, const std::vector<double>& x, std::vector<double>& u,
                Monitor& monitor, unsigned threads) {
  multiply(problem, x, u, threads);
  ++monitor.products;
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += problem.b[i];
  return natural_map(problem, law, x, u);
}

double objective(const Problem& problem, const std::vector<double>& x, const std::vector<double>& u) {
  double f = 0;
  for (std::size_t i = 0; i < x.size(); ++i) f += 0.5 * x[i] * (u[i] + problem.b[i]);
  return f;
}

// Residual (relative to that of zero impulses): a warm start below it is used. The impulses of the last step
// carry the resting bodies, even if their residual is larger because of a new impact. Piles under iteration
// limits sank alike with 2, 3 and 10.
constexpr double worst_start = 3;

Start starting_point(const Problem& problem, const Options& options, Monitor& monitor) {
  const std::size_t m = problem.rows();
  Start cold{std::vector<double>(m, 0.0), problem.b, 0};
  // 0 may lie outside an interval. If it lies in K, u = b costs no product.
  project(problem.K, cold.x, cold.x);
  if (std::all_of(cold.x.begin(), cold.x.end(), [](double v) { return v == 0; }))
    cold.map = natural_map(problem, law_of(problem, options), cold.x, cold.u);
  else
    cold.map = evaluate(problem, law_of(problem, options), cold.x, cold.u, monitor, options.threads);
  if (options.x0.empty()) return cold;
  Start warm{{options.x0.begin(), options.x0.end()}, std::vector<double>(m), 0};
  project(problem.K, warm.x, warm.x);
  warm.map = evaluate(problem, law_of(problem, options), warm.x, warm.u, monitor, options.threads);
  return warm.map < worst_start * cold.map ? warm : cold;
}

void form_velocities(const Problem& problem, Solution& s, unsigned threads) {
  s.u.resize(problem.rows());
  multiply(problem, s.x, s.u, threads);
  s.objective = 0;
  for (std::size_t i = 0; i < s.u.size(); ++i) {
    s.objective += s.x[i] * (0.5 * s.u[i] + problem.b[i]);
    s.u[i] += problem.b[i];
  }
}

void measure(const Problem& problem, Law law, Solution& s, unsigned threads) {
  form_velocities(problem, s, threads);
  s.residual = residual(problem, law, s.x, s.u);
}

Solution finish(const Problem& problem, const Options& options, End end, Monitor& monitor) {
  Solution s;
  s.x = std::move(end.x);
  measure(problem, law_of(problem, options), s, options.threads);
  ++monitor.products;
  const bool reached = s.residual <= options.tolerance;
  // A method that reports convergence may miss the tolerance by the rounding of its updates.
  s.status = reached ? Status::converged : end.status == Status::converged ? Status::stalled : end.status;
  if ((s.status == Status::stalled || s.status == Status::iteration_limit) && !end.last.empty() &&
      infeasible(problem, law_of(problem, options), s.x, s.u, end.last))
    s.status = Status::infeasible;
  s.iterations = monitor.iterations();
  s.products = monitor.products;
  s.factorizations = monitor.factorizations;
  s.time = monitor.elapsed();
  s.method = end.method;
  s.history = std::move(monitor.history);
  return s;
}

}  // namespace amontons
