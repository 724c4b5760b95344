// The solve of a step. A scene that rests presents almost the same problem again and again. Were each solve to
// stop just below the tolerance, every step would start just above it and pay for an iteration or two hundred; and
// what sticks would creep at the speed that the tolerance allows. Hence, where the impulses of the last step are
// nearly a solution already, the solve aims lower, and those of the following steps have nothing to do.
#include <algorithm>

#include "amontons/solvers/solvers.hpp"
#include "amontons/vi/residual.hpp"
#include "multibody/step.hpp"

namespace amontons {

namespace {

constexpr double nearly_solved = 100;   // times the tolerance
constexpr std::size_t few_rows = 1000;  // where a factorisation takes microseconds to a millisecond
// What a solve of a resting scene aims at, times the tolerance, and the iterations that it may take for that.
constexpr double aim_of_few = 1e-5, aim_of_many = 0.5;
constexpr std::size_t iterations_of_few = 300;

Solution accepted(const Problem& problem, const Options& options, std::vector<double> x, std::vector<double> u,
                  double residual) {
  Solution s;
  for (std::size_t i = 0; i < x.size(); ++i) s.objective += 0.5 * x[i] * (u[i] + problem.b[i]);
  s.x = std::move(x), s.u = std::move(u);
  s.status = residual <= options.tolerance ? Status::converged : Status::stalled;
  s.residual = residual, s.products = 1, s.method = "warm start";
  return s;
}

}  // namespace

Solution solve_step(const Problem& problem, const std::string& method, const Options& options) {
  if (options.x0.empty() || problem.rows() == 0) return solve(problem, method, options);
  std::vector<double> x(problem.rows()), u(problem.rows());
  project(problem.K, options.x0, x);
  product(problem.A, x, u);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += problem.b[i];
  const double start = residual(problem, options.law, x, u);
  if (!(start <= nearly_solved * options.tolerance)) return solve(problem, method, options);
  const bool few = problem.rows() <= few_rows;
  Options o = options;
  o.tolerance = (few ? aim_of_few : aim_of_many) * options.tolerance;
  if (start <= (few ? 10 * o.tolerance : options.tolerance)) return accepted(problem, options, std::move(x), std::move(u), start);
  if (few && start <= options.tolerance)
    o.max_iterations = options.max_iterations ? std::min(options.max_iterations, iterations_of_few)
                                              : iterations_of_few;
  Solution s = solve(problem, method, o);
  ++s.products;
  if (s.residual <= options.tolerance) s.status = Status::converged;
  return s;
}

}  // namespace amontons
