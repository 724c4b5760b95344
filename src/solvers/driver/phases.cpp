#include "amontons/solvers/driver/phases.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "amontons/problem/residual.hpp"

namespace amontons {

namespace {

// The frozen problem is solved to this part of the residual of its start: the term is no better than that.
constexpr double frozen_tolerance = 0.02;

// The records of a part as those of the whole, which has come so far.
IterationRecord after(const Solution& total, IterationRecord record) {
  record.iteration += total.iterations;
  record.products += total.products;
  record.time += total.time;
  return record;
}

void append_history(Solution& total, const Solution& part) {
  const double best =
      total.history.empty() ? std::numeric_limits<double>::infinity() : total.history.back().best_residual;
  for (const IterationRecord& record : part.history) {
    total.history.push_back(after(total, record));
    total.history.back().best_residual = std::min(record.best_residual, best);
  }
}

// One outer step of the fixed point on the De Saxce term (Cadoux 2009; Acary, Cadoux, Lemarechal, Malick
// 2011): b_n + s(u) with s constant leaves a convex problem.
Problem with_frozen_term(const Problem& problem, const std::vector<double>& u) {
  Problem frozen = problem;
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t, std::size_t row) {
    double g[S::dim];
    add_saxce_term(set, Law::coulomb, &u[row], g);
    frozen.b[row] += g[0] - u[row];
  });
  return frozen;
}

// The convex problem from the point (x, u) with the given residual; what it returns is measured on the true
// one.
Solution solve_frozen(const Problem& problem, const Options& options, Method method, const Solution& point) {
  Options inner = options;
  inner.law = Law::associated;
  inner.x0 = {};
  inner.tolerance = std::max(0.5 * options.tolerance, frozen_tolerance * point.residual);
  inner.history = false;  // its residuals are those of another problem
  inner.callback = nullptr;
  Solution s = method(with_frozen_term(problem, point.u), inner);
  product(problem.A, s.x, s.u);
  ++s.products;
  for (std::size_t i = 0; i < s.u.size(); ++i) s.u[i] += problem.b[i];
  s.residual = residual(problem, options.law, s.x, s.u);
  if (s.status != Status::interrupted && s.status != Status::deadline) s.status = Status::stalled;
  s.method += ", De Saxce term frozen";
  return s;
}

// The options of one row: what is left of the limits of the caller.
Options options_of(const Phase& phase, const Options& options, const Solution& total, std::size_t left) {
  Options o = options;
  o.tolerance = phase.aim * options.tolerance;
  o.deadline = options.deadline - total.time;
  o.max_iterations = phase.iterations;
  if (options.max_iterations) o.max_iterations = o.max_iterations ? std::min(left, o.max_iterations) : left;
  if (options.callback)
    o.callback = [&](const IterationRecord& record) { return options.callback(after(total, record)); };
  return o;
}

// Whether a row has nothing left to do, or is not meant for what the rows before it left.
bool skips(const Phase& phase, const Options& options, const Solution& total, bool before) {
  if (total.phases.empty()) return false;  // the first row runs
  return total.residual <= phase.aim * options.tolerance || (phase.follows && !before) ||
         (phase.when && !phase.when(options, total));
}

// Adds a part to the whole: its cost, its history, and its x where that is the best so far.
void add_part(Solution& total, const Solution& part, const Phase& phase, const Options& options,
              std::size_t left) {
  if (total.phases.empty() || part.residual <= total.residual) {
    total.x = part.x;
    total.u = part.u;
    total.residual = part.residual;
    total.objective = part.objective;
    total.method = part.method;
  }
  if (part.phases.empty())
    total.phases.push_back({part.method, phase.why, part.iterations, part.residual});
  else  // a table of its own
    total.phases.insert(total.phases.end(), part.phases.begin(), part.phases.end());
  append_history(total, part);
  total.iterations += part.iterations;
  total.products += part.products;
  total.factorizations += part.factorizations;
  total.time += part.time;
  // The limit of a row is none of the caller's: after the last one it means that nothing more helps. A row
  // that converged on something else than what was asked (a frozen term) has only gone as far as it could.
  const bool reached = total.residual <= options.tolerance;
  const bool own_limit = part.status == Status::iteration_limit && part.iterations < left;
  total.status = reached                                         ? Status::converged
                 : own_limit || part.status == Status::converged ? Status::stalled
                                                                 : part.status;
}

// Whether no further row may run.
bool ends(const Solution& total, const Solution& part, const Options& options) {
  return (options.max_iterations && total.iterations >= options.max_iterations) ||
         total.time >= options.deadline || part.status == Status::interrupted ||
         part.status == Status::deadline || part.status == Status::infeasible;
}

}  // namespace

std::string describe(const std::vector<PhaseRecord>& phases) {
  std::string text;
  for (const PhaseRecord& phase : phases) {
    char numbers[64];
    std::snprintf(numbers, sizeof numbers, " (%zu iterations, residual %.1e: ", phase.iterations,
                  phase.residual);
    text += (text.empty() ? "" : ", ") + phase.method + numbers + phase.why + ")";
  }
  return text;
}

Solution run_phases(const Problem& problem, const Options& options, const std::vector<Phase>& table) {
  Solution total, last;
  bool before = false;  // whether the row before ran
  for (const Phase& phase : table) {
    before = !skips(phase, options, total, before);
    if (!before) continue;
    const bool first = total.phases.empty();
    const std::size_t left = options.max_iterations ? options.max_iterations - total.iterations
                                                    : std::numeric_limits<std::size_t>::max();
    const Solution& from = phase.from == Phase::From::last ? last : total;
    Options o = options_of(phase, options, total, left);
    if (!first && phase.from != Phase::From::start) o.x0 = from.x;
    Solution part =
        phase.frozen && !first ? solve_frozen(problem, o, phase.method, from) : phase.method(problem, o);
    add_part(total, part, phase, options, left);
    if (ends(total, part, options)) break;
    last = std::move(part);
  }
  if (table.size() > 1) total.reason = describe(total.phases);
  return total;
}

}  // namespace amontons
