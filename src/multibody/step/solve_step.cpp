// The solve of a step. A resting scene presents almost the same problem in each step. A start within the
// tolerance is accepted. If the start is nearly a solution, the solve aims below the tolerance, so that the
// starts of the next steps are within it.
#include "multibody/step/solve_step.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/base/policy.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/driver/start.hpp"
#include "amontons/solvers/solvers.hpp"
#include "multibody/step/policy.hpp"

namespace amontons {

namespace {

// Solution::method of an accepted start.
constexpr const char* warm_start_method = "warm start";

Solution solution_without_rows() {
  Solution s;
  s.status = Status::converged;
  s.method = "none";
  return s;
}

// The x of a user's solver is measured like any other. An x that overflows is replaced by zero impulses, and
// the safe step follows.
Solution solve_by_own_method(const StepSolver& solver, const Problem& problem, Options options,
                             const Budget& budget) {
  constexpr double moment = 1e-6;  // not tuned: s, because a deadline is positive
  options.deadline = std::max(moment, budget.left());
  const Time start = std::chrono::steady_clock::now();
  Solution s;
  // Rows and masses that a user's solver would read are not all of A beside trees. That of HeldStep reads
  // none.
  s.x = has_trees(problem) && !solver.simulation.trusts_method
            ? solver.simulation.own_method(as_matrix(problem), options)
            : solver.simulation.own_method(problem, options);
  AMONTONS_REQUIRE(s.x.size() == problem.rows(),
                   "method " + solver.simulation.method + " returned " + std::to_string(s.x.size()) +
                       " impulses but the problem has " + std::to_string(problem.rows()) + " rows");
  measure(problem, law_of(problem, options), s);
  if (!std::isfinite(s.residual) || !std::isfinite(s.objective)) {
    std::fill(s.x.begin(), s.x.end(), 0.0);
    project(problem.K, s.x, s.x);
    measure(problem, law_of(problem, options), s);
  }
  const bool right = solver.simulation.trusts_method || s.residual <= options.tolerance;
  s.status = right ? Status::converged : Status::stalled;
  s.iterations = s.products = 1;
  s.method = solver.simulation.method;
  s.time = seconds_since(start);
  return s;
}

Solution solve_with(const StepSolver& solver, const Problem& problem, const Options& options, Budget& budget,
                    Solution memory) {
  ++solver.sums.solves;
  if (solver.simulation.own_method) return solve_by_own_method(solver, problem, options, budget);
  if (solver.is_auto()) return automatic(problem, options, budget, solver.elimination, std::move(memory));
  return solve(problem, solver.simulation.method, options, budget);
}

// With little of the budget left, a first-order method runs at once. Out of budget it makes a few iterations,
// which need no limit of time: a step without any solve costs its successors more.
Solution solve_within_budget(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                             double left) {
  Options options = solver.options();
  options.x0 = x0;
  const bool spent = left <= solver.clock.search;
  const std::size_t few = step::policy.few_iterations;
  if (spent)
    options.max_iterations = options.max_iterations > 0 ? std::min(options.max_iterations, few) : few;
  Budget unlimited;
  ++solver.sums.solves;
  const Method method = law_of(problem, options) == Law::coulomb && problem.K.contacts() > 0 ? apgd : spg;
  Solution s = method(problem, options, spent ? unlimited : solver.budget);
  if (spent && s.status != Status::converged) s.status = Status::deadline;
  solver.sums.add_cost(s);
  return s;
}

// Solves again to the tolerance from the x of s; s becomes the better of the two.
void go_on(const StepSolver& solver, const Problem& problem, Options options, Budget& budget,
           double tolerance, Solution& s) {
  const std::vector<double> start = s.x;
  options.x0 = start;
  options.tolerance = tolerance;
  Solution other = solve_with(solver, problem, options, budget, {});
  solver.sums.add_cost(other);
  join(s, std::move(other));
}

// Continues until light bodies are accurate in their own measure, if possible; the tolerance of the step is
// already met.
Solution solve_for_light_bodies(const StepSolver& solver, const Problem& problem, Budget& budget,
                                Solution s) {
  if (s.status != Status::converged || solver.simulation.trusts_method) return s;
  Options options = solver.options();
  const double finer =
      tolerance_for_light_bodies(problem, law_of(problem, options), s, solver.fastest, options.tolerance);
  if (!(finer < options.tolerance)) return s;
  go_on(solver, problem, options, budget, finer, s);
  // A light body that is still wrong has not converged, whatever the residual.
  if (tolerance_for_light_bodies(problem, law_of(problem, options), s, solver.fastest, options.tolerance) <
      options.tolerance)
    s.status = Status::stalled;
  return s;
}

// Marks a solve that aimed below the tolerance and reached it as converged.
Solution as_converged(Solution s, double tolerance) {
  if (s.residual <= tolerance) s.status = Status::converged;
  return s;
}

// Decides by the residual of the start. Far from a solution: solve to the tolerance. Within the tolerance:
// accept the start. Nearly within it: solve to rounding, or below the tolerance if the direct way does not
// apply. A start is near if the velocities have three right digits: most faces are then those of the
// solution, and Newton's method needs few steps from there.
Solution solve_from(const StepSolver& solver, const Problem& problem, StepStart start, Budget& budget,
                    Solution memory) {
  Options options = solver.options();
  if (start.x0.empty()) return solve_with(solver, problem, options, budget, std::move(memory));
  options.x0 = start.x0;
  measure_start(problem, options, memory);
  const double tolerance = options.tolerance, error = memory.residual;
  if (!(error <= std::max(base::policy.three_digits, tolerance)))
    return solve_with(solver, problem, options, budget, std::move(memory));
  if (error <= step::policy.direct_start * tolerance) return accepted(std::move(memory), warm_start_method);
  if (solver.is_auto() && solve_directly(problem, options, budget, solver.elimination, memory)) {
    ++solver.sums.solves;
    return memory;
  }
  if (error <= tolerance) {
    measure_start(problem, options, memory);
    return accepted(std::move(memory), warm_start_method);
  }
  if (!start.again) options.tolerance = 0.5 * tolerance;
  if (!solver.is_auto()) return as_converged(solve_with(solver, problem, options, budget, {}), tolerance);
  ++solver.sums.solves;
  return as_converged(solve_iteratively(problem, options, budget), tolerance);
}

}  // namespace

Options StepSolver::options() const {
  Options options;
  options.law = simulation.law;
  options.tolerance = simulation.tolerance;
  options.max_iterations = simulation.max_iterations;
  options.threads = simulation.threads;
  options.iterates = simulation.iterates;
  return options;
}

double most_work(std::size_t blocks) { return step::policy.work_per_block * static_cast<double>(1 + blocks); }

Solution solve_step(const StepSolver& solver, const Problem& problem, StepStart start, Solution memory) {
  if (problem.rows() == 0) return solution_without_rows();
  if (const double left = solver.budget.left(); left <= solver.clock.searches())
    return solve_within_budget(solver, problem, start.x0, left);
  // Later solves and the safe step keep some of the work.
  Budget share = solver.budget.part_of_work(step::policy.share_of_part);
  Solution s = solve_from(solver, problem, start, share, std::move(memory));
  solver.sums.add_cost(s);
  return solve_for_light_bodies(solver, problem, share, std::move(s));
}

// The natural residual of the whole problem, from the maps of the islands that move.
static double residual_beside_rest(const StepIslands& islands, SquaredMaps moving) {
  for (const Island& i : islands.each)
    if (i.rests) moving.add(i.start);
  return moving.residual();
}

// The residual of the whole is at most the largest of an island, and that of the islands at rest was measured
// with their start. An error that the others left may be within the tolerance of the whole.
static void measure_beside(const StepSolver& solver, const Problem& problem, const StepIslands& islands,
                           const Sleepers& asleep, double residual, Solution& s) {
  const double at_zero = problem.rows() > 0 ? natural_map_at_zero(problem, solver.simulation.law) : 0;
  SquaredMaps all = asleep.maps;
  all.add({residual * residual * at_zero * at_zero, at_zero * at_zero});
  s.residual = residual_beside_rest(islands, all);
  const double tolerance = solver.simulation.tolerance;
  if (residual > tolerance && s.residual <= tolerance) s.status = Status::converged;
}

// No search for errors of light bodies among those at rest: each of their velocities is known to be slow.
void solve_beside(const StepSolver& solver, const StepProblem& posed, const Sleepers& asleep,
                  Solved& solved) {
  StepIslands& islands = solved.islands;
  Solution& s = solved.solution;
  if (!islands.any_rests) {
    s = solve_step(solver, *posed.problem, {posed.x0, posed.again}, std::move(s));
    if (asleep.any()) measure_beside(solver, *posed.problem, islands, asleep, s.residual, s);
  } else if (islands.all_rest()) {
    s.residual = residual_beside_rest(islands, asleep.maps);
    s = accepted(std::move(s), warm_start_method);
    solver.sums.add_cost(s);
  } else {
    Part& part = islands.moving;
    part.solution = solve_step(solver, part.of.problem, {part.x0, posed.again}, std::move(part.solution));
    Merging(s, solver.simulation.tolerance).add(part);
    measure_beside(solver, part.of.problem, islands, asleep, part.solution.residual, s);
  }
}

}  // namespace amontons
