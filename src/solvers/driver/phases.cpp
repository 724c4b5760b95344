#include "amontons/solvers/driver/phases.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

namespace {

// The frozen problem is solved to this part of the residual of its start. Its solution is a solution of the
// true problem up to the change of the frozen term, which is of the order of that residual: two digits more
// are gained at best, and further ones would be those of the wrong problem.
constexpr double frozen_tolerance = 0.02;

// The records of a part as those of the whole, which has come so far: a history of several phases reads as
// that of one method, with iterations, products and time that never fall.
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
// 2011). Coulomb's law asks for x in K with u + s(u) e_n in K* and <x, u + s(u) e_n> = 0, s(u) = mu |u_t|.
// For a constant s this is the associated law with b_n + s in place of b_n, a convex problem with a solution
// u'(s); the law holds where s = s(u'(s)), a fixed point that exists under mild conditions (they prove it),
// though the iteration s := s(u'(s)) need not contract. So one step of it is a phase among others.
Problem with_frozen_term(const Problem& problem, const std::vector<double>& u) {
  Problem frozen = problem;
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t, std::size_t row) {
    double g[S::dim];
    add_saxce_term(set, Law::coulomb, &u[row], g);
    frozen.b[row] += g[0] - u[row];
  });
  return frozen;
}

// The convex problem of a point; what comes back is measured on the true one. It starts cold: the friction
// directions of the point are in the term, and its stresses, which the phase is to replace, are no help.
Solution solve_frozen(const Problem& problem, const Options& options, Method method, const Solution& point) {
  Options inner = options;
  inner.law = Law::associated;
  inner.x0 = {};
  inner.tolerance = std::max(0.5 * options.tolerance, frozen_tolerance * point.residual);
  inner.history = false;  // its residuals are those of another problem
  inner.callback = nullptr;
  Solution s = method(with_frozen_term(problem, point.u), inner);
  measure(problem, options.law, s);
  ++s.products;
  // Its other statuses speak of the frozen problem.
  if (s.status != Status::interrupted && s.status != Status::deadline) s.status = Status::stalled;
  s.method += ", De Saxce term frozen";
  return s;
}

// The options of one row: the smaller of its own limit and what is `left` of the caller's, the rest of the
// deadline, records that count on from those of the rows before.
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
  //
  // The residual is that of the best x, which an earlier row may have made; the status is that of the last.
  const bool reached = total.residual <= options.tolerance;
  const bool own_limit = part.status == Status::iteration_limit && part.iterations < left;
  total.status = reached                                         ? Status::converged
                 : own_limit || part.status == Status::converged ? Status::stalled
                                                                 : part.status;
}

// Whether no further row may run: limits of the caller or of the step, his wish to stop, or a proof that
// nothing is to find.
bool ends(const Solution& total, const Solution& part, const Options& options) {
  return (options.max_iterations && total.iterations >= options.max_iterations) ||
         total.time >= options.deadline || Patience::exhausted() || part.status == Status::interrupted ||
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
  // The best and the sums so far; what the row before returned.
  Solution total, last;
  bool before = false;  // whether the row before ran
  for (const Phase& phase : table) {
    before = !skips(phase, options, total, before);
    if (!before) continue;
    // The first row starts where the caller's options say; nothing is known yet that it could start from.
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
