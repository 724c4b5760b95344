#include "amontons/solvers/driver/phases.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

namespace {

// A record of a part as a record of the whole solve so far. A history of several phases reads as that of one
// method: iterations, products and time never fall.
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

// Options of one row: the smaller of its own limit and the caller's remaining `left` iterations, and records
// that continue those of earlier rows.
Options options_of(const Phase& phase, const Options& options, const Solution& total, std::size_t left) {
  Options o = options;
  o.max_iterations = phase.iterations;
  if (options.max_iterations) o.max_iterations = o.max_iterations ? std::min(left, o.max_iterations) : left;
  if (options.callback)
    o.callback = [&](const IterationRecord& record) { return options.callback(after(total, record)); };
  return o;
}

// Adds the cost and history of a part to the whole, and takes its x if that is the best so far.
void add_part(Solution& total, const Solution& part, const Phase& phase, const Options& options,
              std::size_t left) {
  if (total.phases.empty() || part.residual <= total.residual) {
    total.x = part.x;
    total.u = part.u;
    total.residual = part.residual;
    total.objective = part.objective;
    total.method = part.method;
    total.device = part.device;
  }
  if (part.phases.empty())
    total.phases.push_back({part.method, phase.why, part.iterations, part.residual});
  else  // a phase that is itself a table
    total.phases.insert(total.phases.end(), part.phases.begin(), part.phases.end());
  append_history(total, part);
  add_counts(total, part);
  total.time += part.time;
  // A row's own limit is not a limit of the caller: after the last row it means that no row can improve x.
  // The residual is that of the best x, possibly from an earlier row; the status is that of the last row.
  const bool reached = total.residual <= options.tolerance;
  const bool own_limit = part.status == Status::iteration_limit && part.iterations < left;
  total.status = reached                                         ? Status::converged
                 : own_limit || part.status == Status::converged ? Status::stalled
                                                                 : part.status;
}

// Whether no further row may run: limits of the caller or of the step, an interrupt, or a proof of
// infeasibility.
bool ends(const Solution& total, const Solution& part, const Options& options, const Budget& budget) {
  return (options.max_iterations && total.iterations >= options.max_iterations) || budget.late() ||
         budget.exhausted() || part.status == Status::interrupted || part.status == Status::deadline ||
         part.status == Status::infeasible;
}

}  // namespace

void add_counts(Solution& total, const Solution& part) {
  total.iterations += part.iterations;
  total.products += part.products;
  total.factorizations += part.factorizations;
}

bool take_better(Solution& s, Solution&& other) {
  if (!s.x.empty() && !(other.residual < s.residual)) return false;
  s.x = std::move(other.x);
  s.u = std::move(other.u);
  s.residual = other.residual;
  s.objective = other.objective;
  s.method = std::move(other.method);
  s.device = std::move(other.device);
  return true;
}

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

Solution run_phases(const Problem& problem, const Options& options, Budget& budget,
                    const std::vector<Phase>& table) {
  Solution total;  // the best and the sums so far
  for (const Phase& phase : table) {
    // The first row starts as the caller's options say, because there is no earlier result.
    const bool first = total.phases.empty();
    if (!first && total.residual <= options.tolerance) break;
    const std::size_t left = options.max_iterations ? options.max_iterations - total.iterations
                                                    : std::numeric_limits<std::size_t>::max();
    Options o = options_of(phase, options, total, left);
    if (!first) o.x0 = total.x;
    const Solution part = phase.method(problem, o, budget);
    add_part(total, part, phase, options, left);
    if (ends(total, part, options, budget)) break;
  }
  if (table.size() > 1) total.reason = describe(total.phases);
  return total;
}

}  // namespace amontons
