// The solve of a step. A scene that rests presents almost the same problem again and again. Were each solve
// to stop just below the tolerance, every step would start just above it and pay for an iteration or two
// hundred; and what sticks would creep at the speed that the tolerance allows. Hence, where the impulses of
// the last step are nearly a solution already, the solve aims lower, and those of the following steps have
// nothing to do.
#include "multibody/step/solve_step.hpp"

#include <algorithm>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/solvers.hpp"

namespace amontons {

namespace {

// Times the tolerance: a start below this is that of a scene at rest. Residuals are relative to that of zero
// impulses: with the default tolerance of 1e-6 it is a start with four right digits.
// With a loose tolerance it is no more than these three.
constexpr double nearly_solved = 100, three_digits = 1e-3;
// Problems of few rows aim far below the tolerance, which takes first-order iterations of microseconds: so
// many at most, after the tolerance is reached. Of many rows, half the tolerance is what pays, if it takes no
// more than so much work (Patience) for each block: rounding may be as large.
constexpr double aim_of_few = 1e-5, aim_of_many = 0.5, work_of_many = 300;
// Times the aim of few: not worth another iteration.
constexpr double close_to_aim = 10;
// Times the tolerance: a start of few rows that is taken as it is. More than the aim, as robots that stand
// give way by the regularisation of their joints, which changes the problem a little in every step.
constexpr double close_start = 1e-2;
constexpr std::size_t polish_iterations = 200;
// Of the time that finding the contacts took: with less of the budget left no choice is made between methods,
// each of which would have to be set up.
constexpr double hurried = 6;
constexpr std::size_t few_iterations = 10;

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
  s.method = "warm start";
  return s;
}

// The method that goes on from a solution: of `auto` a first-order one, whose iteration costs one product and
// which profits from a start that is nearly right, where a factorisation would not.
Method method_of(const std::string& name, const Problem& problem, Law law) {
  if (name != "auto") return find_method(name);
  return law == Law::coulomb && problem.K.contacts() > 0 ? apgd : spg;
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
    s = method_of("auto", problem, options.law)(problem, options);
    if (s.status == Status::converged) return s;
  }
  if (too_late) s.status = Status::deadline;
  solver.elimination.settle(problem, options, s);
  return s;
}

// A solve of few rows goes far below the tolerance as soon as it is reached, once; the steps that follow find
// a start that is good enough (`accepted`). Limits and deadline of the caller hold for both parts together.
//
// Goes on from a converged solution, which stays converged: better or as it was.
Solution polished(const Problem& problem, const std::string& method, const Options& options, Solution s) {
  Options o = options;
  o.x0 = s.x;
  o.max_iterations =
      options.max_iterations ? std::min(options.max_iterations, polish_iterations) : polish_iterations;
  o.deadline = options.deadline - s.time;
  if (!(o.deadline > 0)) return s;
  o.tolerance = aim_of_few * options.tolerance;
  Solution finer = method_of(method, problem, options.law)(problem, o);
  add_counts(s, finer);
  s.time += finer.time;
  const PhaseRecord record{finer.method, "what rests shall not creep", finer.iterations, finer.residual};
  if (take_better(s, std::move(finer))) s.phases.push_back(record);
  return s;
}

// Solves again to the tolerance from the x of s, which becomes the better of both; how that solve ended.
Status go_on(const StepSolver& solver, const Problem& problem, Options options, double tolerance,
             Solution& s) {
  const std::vector<double> start = s.x;
  options.x0 = start;
  options.tolerance = tolerance;
  options.deadline = solver.clock.left();
  Solution other = solve_with(solver, problem, options, {});
  const Status status = other.status;
  add_counts(s, other);
  s.time += other.time;
  take_better(s, std::move(other));
  return status;
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

}  // namespace

double most_work(std::size_t blocks) {
  constexpr double least = 1.5e6, per_pair = 100, large = 400;
  const auto n = static_cast<double>(blocks);
  return least + per_pair * n * std::min(n, large);
}

Patience share_of_step(bool missed, double seconds) {
  constexpr double most = 0.5, after_a_miss = 0.1;
  return Patience(seconds, {}, Patience::Catches::no, (missed ? after_a_miss : most) * Patience::work_left());
}

// At first to half the tolerance, as long as that is cheap.
static Solution solve_many(const StepSolver& solver, const Problem& problem, Options options,
                           Solution memory) {
  const double tolerance = options.tolerance;
  Solution s;
  {
    const auto blocks = static_cast<double>(problem.K.blocks());
    const Patience some(infinity, {}, Patience::Catches::no, work_of_many * blocks);
    options.tolerance = aim_of_many * tolerance;
    s = solve_with(solver, problem, options, std::move(memory));
  }
  if (s.residual <= tolerance)
    s.status = Status::converged;
  else if (!solver.clock.over())
    s.status = go_on(solver, problem, options, tolerance, s);
  return s;
}

// Four cases, from the residual of the start: far from a solution (solve), near enough (accept), many rows
// (solve to half the tolerance), few rows (solve, then polish).
static Solution solve_seen(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                           Solution memory) {
  const std::string& method = solver.method;
  Options options = solver.options;
  options.deadline = solver.clock.left();
  if (x0.empty()) return solve_with(solver, problem, options, std::move(memory));
  options.x0 = x0;
  const double start = look_at_start(problem, options, memory);
  const bool few = problem.rows() <= few_rows;
  const double close = close_to_aim * aim_of_few * options.tolerance;
  // Something happens in this step: nothing to aim at but the tolerance.
  const double resting =
      std::min(nearly_solved * options.tolerance, std::max(three_digits, options.tolerance));
  if (!(start <= resting) || (solver.again && !few && start > options.tolerance))
    return solve_with(solver, problem, options, std::move(memory));
  if (start <= (few ? close_start : 1) * options.tolerance)
    return accepted(problem, std::move(memory), start);
  // The direct way goes as far by itself.
  if (method == "auto") {
    if (solver.elimination.solve(problem, options, memory) &&
        (memory.status == Status::converged || solver.clock.over()))
      return memory;
    look_at_start(problem, options, memory);
    options.deadline = solver.clock.left();
  }
  if (!few) return solve_many(solver, problem, options, std::move(memory));
  Solution s = start <= options.tolerance ? accepted(problem, std::move(memory), start)
                                          : solve_with(solver, problem, options, {});
  if (s.status != Status::converged || s.residual <= close) return s;
  return polished(problem, method, options, std::move(s));
}

Solution solve_step(const StepSolver& solver, const Problem& problem, std::span<const double> x0,
                    Solution memory) {
  if (problem.rows() == 0) return nothing();
  if (solver.clock.over(hurried * solver.look)) return in_a_hurry(solver, problem, x0);
  const Patience share = share_of_step(solver.missed, solver.clock.left());
  return with_unseen(solver, problem, solve_seen(solver, problem, x0, std::move(memory)));
}

}  // namespace amontons
