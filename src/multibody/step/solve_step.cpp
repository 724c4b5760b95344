// The solve of a step. A scene that rests presents almost the same problem again and again. A start within
// the tolerance is accepted. Where the start is nearly a solution, the solve aims below the tolerance, so
// that the starts of the next steps are within it.
#include "multibody/step/solve_step.hpp"

#include <algorithm>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/solvers.hpp"

namespace amontons {

namespace {

// A start with a residual below this multiple of the tolerance, and below three digits, is that of a scene at
// rest.
constexpr double nearly_solved = 100, three_digits = 1e-3;
// Aim of first-order methods at rest, as a fraction of the tolerance: the next ten starts are within the
// tolerance.
constexpr double aim_at_rest = 0.1;
// Fraction of the tolerance above which a start is solved for again where the direct way applies, which goes
// to rounding in microseconds.
constexpr double direct_start = 1e-2;
// Of the time that finding the contacts took: with less of the budget left no choice is made between methods,
// each of which would have to be set up.
constexpr double hurried = 6;
constexpr std::size_t few_iterations = 10;
// Solution::method of a start that is accepted.
constexpr const char* warm_start = "warm start";

// A problem without rows, and its solution.
Solution nothing() {
  Solution s;
  s.status = Status::converged;
  s.method = "none";
  return s;
}

Solution solve_with(const StepSolver& solver, const Problem& problem, const Options& options,
                    Solution memory) {
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
  return residual(problem, options.law, s.x, s.u);
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
  s.method = warm_start;
  return s;
}

// Where little is left of the budget, a first-order method, with joints that hold. Where it would be set up
// for nothing it makes some iterations all the same, which take a third of that: bodies that nothing holds
// sink into each other, and the next steps have the more to do. What has had its positions corrected for the
// time of these goes on with the impulses of the last step.
Solution in_a_hurry(const StepSolver& solver, const Problem& problem, std::span<const double> x0) {
  Options options = solver.options;
  options.x0 = x0;
  options.deadline = solver.clock.left();
  const bool too_late = solver.clock.over(solver.look);
  Solution s;
  if (solver.clock.over(0.5 * solver.look) && solver.corrected && !x0.empty()) {
    const double start = look_at_start(problem, options, s);
    s = accepted(problem, std::move(s), start);
    if (start <= options.tolerance) return s;
  } else {
    if (too_late) {
      options.deadline = infinity;
      options.max_iterations =
          std::min(options.max_iterations ? options.max_iterations : few_iterations, few_iterations);
    }
    const Method method = options.law == Law::coulomb && problem.K.contacts() > 0 ? apgd : spg;
    s = method(problem, options);
    if (s.status == Status::converged) return s;
  }
  if (too_late) s.status = Status::deadline;
  solver.elimination.settle(problem, options, s);
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
Solution with_unseen(const StepSolver& solver, const Problem& problem, Solution s) {
  if (s.status != Status::converged) return s;
  Options options = solver.options;
  const double finer = tolerance_of_unseen(problem, options.law, s, solver.fastest, options.tolerance);
  if (!(finer < options.tolerance)) return s;
  go_on(solver, problem, options, finer, s);
  // What is wrong still has not converged, whatever the heavy bodies make of the residual.
  if (tolerance_of_unseen(problem, options.law, s, solver.fastest, solver.options.tolerance) <
      solver.options.tolerance)
    s.status = Status::stalled;
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
  if (!(start <= std::min(nearly_solved * tolerance, std::max(three_digits, tolerance))))
    return solve_with(solver, problem, options, std::move(memory));
  if (start <= (solver.at_rest ? 1 : direct_start) * tolerance)
    return accepted(problem, std::move(memory), start);
  if (solver.method == "auto" && solve_directly(problem, options, solver.elimination, memory)) return memory;
  if (start <= tolerance) {
    look_at_start(problem, options, memory);
    return accepted(problem, std::move(memory), start);
  }
  if (!solver.again) options.tolerance = aim_at_rest * tolerance;
  Solution s = solver.method == "auto" ? solve_by_race(problem, options, solver.elimination)
                                       : solve(problem, solver.method, options);
  if (s.residual <= tolerance) s.status = Status::converged;
  return s;
}

}  // namespace

bool is_accepted_start(const Solution& solution) { return solution.method == warm_start; }

double most_work(std::size_t blocks) {
  constexpr double least = 1.5e6, per_pair = 100, large = 400;
  const auto n = static_cast<double>(blocks);
  return least + per_pair * n * std::min(n, large);
}

Patience share_of_step(bool missed, double seconds) {
  constexpr double most = 0.5, after_a_miss = 0.1;
  return Patience(seconds, {}, Patience::Catches::no, (missed ? after_a_miss : most) * Patience::work_left());
}

Solution solve_step(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                    Solution memory) {
  if (problem.rows() == 0) return nothing();
  if (solver.clock.over(hurried * solver.look)) return in_a_hurry(solver, problem, x0);
  const Patience share = share_of_step(solver.missed, solver.clock.left());
  return with_unseen(solver, problem, solve_from(solver, problem, x0, std::move(memory)));
}

}  // namespace amontons
