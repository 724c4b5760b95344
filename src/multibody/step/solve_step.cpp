// The solve of a step. A scene that rests presents almost the same problem again and again. A start within
// the tolerance is accepted. Where the start is nearly a solution, the solve aims below the tolerance, so
// that the starts of the next steps are within it.
#include "multibody/step/solve_step.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "amontons/base/ablation.hpp"
#include "amontons/base/error.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/solvers.hpp"
#include "multibody/step/policy.hpp"

namespace amontons {

namespace {

// Solution::method of a start that is accepted.
constexpr const char* warm_start_method = "warm start";

Solution solution_without_rows() {
  Solution s;
  s.status = Status::converged;
  s.method = "none";
  return s;
}

// What a solver of the user's returns is measured like every x. From an x that overflows nothing follows: it
// counts as no impulses, and the safe step does the rest.
Solution solve_by_own_method(const StepSolver& solver, const Problem& problem, const Options& options) {
  const Time start = std::chrono::steady_clock::now();
  Solution s;
  s.x = (*solver.own_method)(problem, options);
  AMONTONS_REQUIRE(s.x.size() == problem.rows(),
                   "method " + solver.method + " returned " + std::to_string(s.x.size()) +
                       " impulses but the problem has " + std::to_string(problem.rows()) + " rows");
  measure(problem, law_of(problem, options), s);
  if (!std::isfinite(s.residual) || !std::isfinite(s.objective)) {
    std::fill(s.x.begin(), s.x.end(), 0.0);
    project(problem.K, s.x, s.x);
    measure(problem, law_of(problem, options), s);
  }
  s.status = s.residual <= options.tolerance ? Status::converged : Status::stalled;
  s.iterations = s.products = 1;
  s.method = solver.method;
  s.time = seconds_since(start);
  return s;
}

Solution solve_with(const StepSolver& solver, const Problem& problem, const Options& options,
                    Solution memory) {
  ++solver.solves;
  if (solver.own_method) return solve_by_own_method(solver, problem, options);
  if (solver.method == "auto") return automatic(problem, options, solver.elimination, std::move(memory));
  return solve(problem, solver.method, options);
}

// x and u of the start, projected; its residual.
double look_at_start(const Problem& problem, const Options& options, Solution& s) {
  s.x.resize(problem.rows());
  s.u.resize(problem.rows());
  project(problem.K, options.x0, s.x);
  product(problem.A, s.x, s.u);
  for (std::size_t i = 0; i < s.u.size(); ++i) s.u[i] += problem.b[i];
  return residual(problem, law_of(problem, options), s.x, s.u);
}

// The start as the solution, with the residual that it has.
Solution accepted(const Problem& problem, Solution memory, double residual) {
  Solution s;
  s.x = std::move(memory.x);
  s.u = std::move(memory.u);
  for (std::size_t i = 0; i < s.x.size(); ++i) s.objective += 0.5 * s.x[i] * (s.u[i] + problem.b[i]);
  s.residual = residual;
  s.status = Status::converged;
  s.products = 1;
  s.method = warm_start_method;
  return s;
}

// If little of the budget is left, a first-order method. Out of budget it makes a few iterations all the
// same, or goes on with the impulses of the last step if positions were corrected in the time of these. The
// safe step restores the joints afterwards.
Solution solve_within_budget(const StepSolver& solver, const Problem& problem, std::span<const double> x0) {
  Options options = solver.options;
  options.x0 = x0;
  options.deadline = solver.clock.left();
  const bool spent = solver.clock.over(solver.look);
  Solution s;
  if (solver.corrected && !x0.empty() && solver.clock.over(0.5 * solver.look)) {
    const double start = look_at_start(problem, options, s);
    s = accepted(problem, std::move(s), start);
    if (start > options.tolerance) s.status = Status::deadline;
    return s;
  }
  if (spent) {
    options.deadline = infinity;
    options.max_iterations = std::min(options.max_iterations ? options.max_iterations : step::few_iterations,
                                      step::few_iterations);
  }
  ++solver.solves;
  const Method method = law_of(problem, options) == Law::coulomb && problem.K.contacts() > 0 ? apgd : spg;
  s = method(problem, options);
  if (spent && s.status != Status::converged) s.status = Status::deadline;
  return s;
}

// Solves again to the tolerance from the x of s, which becomes the better of both.
void go_on(const StepSolver& solver, const Problem& problem, Options options, double tolerance, Solution& s) {
  const std::vector<double> start = s.x;
  options.x0 = start;
  options.tolerance = tolerance;
  options.deadline = solver.clock.left();
  Solution other = solve_with(solver, problem, options, {});
  add_counts(s, other);
  s.time += other.time;
  take_better(s, std::move(other));
}

// Goes on until light bodies are right in their own measure, as far as they come: the tolerance of the step
// is kept already.
Solution solve_for_light_bodies(const StepSolver& solver, const Problem& problem, Solution s) {
  if (s.status != Status::converged || off("light bodies")) return s;
  Options options = solver.options;
  const double finer =
      tolerance_for_light_bodies(problem, law_of(problem, options), s, solver.fastest, options.tolerance);
  if (!(finer < options.tolerance)) return s;
  go_on(solver, problem, options, finer, s);
  // What is wrong still has not converged, whatever the heavy bodies make of the residual.
  if (tolerance_for_light_bodies(problem, law_of(problem, options), s, solver.fastest,
                                 solver.options.tolerance) < solver.options.tolerance)
    s.status = Status::stalled;
  return s;
}

// A solve that aimed lower than it had to.
Solution as_converged(Solution s, double tolerance) {
  if (s.residual <= tolerance) s.status = Status::converged;
  return s;
}

// From the residual of the start: far from a solution (solve to the tolerance), solved (accept), nearly
// solved (solve to rounding, or below the tolerance where the direct way does not apply).
Solution solve_from(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                    Solution memory) {
  Options options = solver.options;
  options.deadline = solver.clock.left();
  if (x0.empty()) return solve_with(solver, problem, options, std::move(memory));
  options.x0 = x0;
  const double tolerance = options.tolerance, start = look_at_start(problem, options, memory);
  if (!(start <= std::min(step::near_rest * tolerance, std::max(step::three_digits, tolerance))))
    return solve_with(solver, problem, options, std::move(memory));
  if (start <= (solver.at_rest || off("direct start") ? 1 : step::direct_start) * tolerance)
    return accepted(problem, std::move(memory), start);
  if (solver.is_auto() && solve_directly(problem, options, solver.elimination, memory)) {
    ++solver.solves;
    return memory;
  }
  if (start <= tolerance) {
    look_at_start(problem, options, memory);
    return accepted(problem, std::move(memory), start);
  }
  if (!solver.again) options.tolerance = 0.5 * tolerance;
  if (!solver.is_auto()) return as_converged(solve_with(solver, problem, options, {}), tolerance);
  ++solver.solves;
  return as_converged(solve_by_race(problem, options), tolerance);
}

}  // namespace

bool is_accepted_start(const Solution& solution) { return solution.method == warm_start_method; }

double most_work(std::size_t blocks) {
  const auto n = static_cast<double>(blocks);
  return step::least_work + step::work_per_pair * n * std::min(n, step::large_step);
}

Patience share_of_step(bool missed, double seconds) {
  const double share = missed && !off("share after a miss") ? step::work_after_miss : 0.5;
  return Patience(seconds, {}, Patience::Catches::no, share * Patience::work_left());
}

Solution solve_step(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                    Solution memory) {
  if (problem.rows() == 0) return solution_without_rows();
  if (solver.clock.over(step::hurried * solver.look)) return solve_within_budget(solver, problem, x0);
  const Patience share = share_of_step(solver.missed, solver.clock.left());
  return solve_for_light_bodies(solver, problem, solve_from(solver, problem, x0, std::move(memory)));
}

}  // namespace amontons
