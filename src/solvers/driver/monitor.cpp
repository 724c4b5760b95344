#include "amontons/solvers/driver/monitor.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/base/error.hpp"
#include "amontons/problem/infeasibility.hpp"
#include "amontons/problem/residual.hpp"

namespace amontons {

namespace {
constexpr double poll_period = 2e-3;  // s between two looks at the interrupt
constexpr double progress = 0.99;     // the best residual must shrink by 1 % within the stall window
}  // namespace

Monitor::Monitor(const Options& options, std::size_t default_iterations, std::size_t stall_window)
    : options_(options),
      start_(std::chrono::steady_clock::now()),
      limit_(options.max_iterations ? options.max_iterations : default_iterations),
      stall_window_(stall_window) {
  if (options.history) history.reserve(std::min<std::size_t>(limit_ + 1, 1 << 16));
}

double Monitor::elapsed() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

bool Monitor::out_of_time() { return elapsed() > options_.deadline; }

std::optional<Status> Monitor::observe(double residual, double objective, double step,
                                       std::size_t backtracks) {
  const double now = elapsed();
  improved_ = residual < best_;
  if (improved_) best_ = residual;
  const IterationRecord record{iterations_, products, now, residual, best_, objective, step, backtracks};
  if (options_.history) history.push_back(record);
  if (residual <= options_.tolerance) return Status::converged;
  if (options_.callback && options_.callback(record)) return Status::interrupted;
  if (now > options_.deadline) return Status::deadline;
  if (options_.interrupted && now - last_poll_ > poll_period) {
    last_poll_ = now;
    if (options_.interrupted()) return Status::interrupted;
  }
  if (iterations_ >= limit_) return Status::iteration_limit;
  if (best_ <= progress * milestone_) milestone_ = best_, last_progress_ = iterations_;
  if (iterations_ - last_progress_ > stall_window_ || !std::isfinite(residual)) return Status::stalled;
  ++iterations_;
  return std::nullopt;
}

void require_curvature(double dAd, double dPd) {
  AMONTONS_REQUIRE(dAd >= -1e-5 * dPd, "A is not positive semidefinite: <d, A d> = " + std::to_string(dAd) +
                                           " along a direction with <d, P d> = " + std::to_string(dPd) +
                                           "; check the signs of its rows");
}

namespace {

// Candidates for a certificate at the end of a solve that failed: the impulses themselves, which run off
// along it, and the step of the natural map, which tends to the smallest displacement of the projected
// iteration (Banjac et al. 2019).
bool infeasible(const Problem& problem, Law law, std::span<const double> x, std::span<const double> u) {
  if (proves_infeasible(problem, law, x)) return true;
  std::vector<double> step(x.size());
  for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
    double trial[Set::dim];
    for (int k = 0; k < Set::dim; ++k) trial[k] = x[row + k] - u[row + k] / problem.P[block];
    set.project(trial, &step[row]);
    for (int k = 0; k < Set::dim; ++k) step[row + k] -= x[row + k];
  });
  return proves_infeasible(problem, law, step);
}

}  // namespace

Solution finish(const Problem& problem, const Options& options, const char* method, std::vector<double> x,
                Status status, Monitor& monitor) {
  Solution s;
  s.u.resize(problem.rows());
  product(problem.A, x, s.u);
  ++monitor.products;
  for (std::size_t i = 0; i < x.size(); ++i) {
    s.objective += x[i] * (0.5 * s.u[i] + problem.b[i]);
    s.u[i] += problem.b[i];
  }
  s.residual = residual(problem, options.law, x, s.u);
  const bool reached = s.residual <= options.tolerance;
  // A method that believed to be done may be above the tolerance by the rounding of its own running sums.
  s.status = reached ? Status::converged : status == Status::converged ? Status::stalled : status;
  if ((s.status == Status::stalled || s.status == Status::iteration_limit) &&
      infeasible(problem, options.law, x, s.u))
    s.status = Status::infeasible;
  s.x = std::move(x);
  s.iterations = monitor.iterations();
  s.products = monitor.products;
  s.factorizations = monitor.factorizations;
  s.time = monitor.elapsed();
  s.method = method;
  s.history = std::move(monitor.history);
  return s;
}

double starting_point(const Problem& problem, const Options& options, std::span<double> x,
                      std::span<double> u, Monitor& monitor) {
  const std::size_t m = problem.rows();
  const double scale = natural_map_at_zero(problem, options.law);
  std::fill(x.begin(), x.end(), 0.0);
  project(problem.K, x, x);  // 0 may lie outside an interval
  const bool at_zero = std::all_of(x.begin(), x.end(), [](double v) { return v == 0; });
  std::copy(problem.b.begin(), problem.b.end(), u.begin());
  const auto form_u = [&](std::span<const double> point, std::span<double> out) {
    product(problem.A, point, out);
    ++monitor.products;
    for (std::size_t i = 0; i < m; ++i) out[i] += problem.b[i];
  };
  if (!at_zero) form_u(x, u);
  const double cold = natural_map(problem, options.law, x, u) / scale;
  if (options.x0.empty()) return cold;
  std::vector<double> warm_x(options.x0.begin(), options.x0.end()), warm_u(m);
  project(problem.K, warm_x, warm_x);
  form_u(warm_x, warm_u);
  const double warm = natural_map(problem, options.law, warm_x, warm_u) / scale;
  if (!(warm < cold)) return cold;
  std::copy(warm_x.begin(), warm_x.end(), x.begin());
  std::copy(warm_u.begin(), warm_u.end(), u.begin());
  return warm;
}

}  // namespace amontons
