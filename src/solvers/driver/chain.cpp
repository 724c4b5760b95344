#include "amontons/solvers/driver/chain.hpp"

#include <algorithm>
#include <limits>

namespace amontons {

namespace {

void append_history(Solution& total, const Solution& part) {
  const double best = total.history.empty() ? part.residual + 1e300 : total.history.back().best_residual;
  for (IterationRecord record : part.history) {
    record.iteration += total.iterations;
    record.products += total.products;
    record.time += total.time;
    record.best_residual = std::min(record.best_residual, best);
    total.history.push_back(record);
  }
}

}  // namespace

Solution run_phases(const Problem& problem, const Options& options, const std::vector<Phase>& phases) {
  Solution total;
  for (std::size_t k = 0; k < phases.size(); ++k) {
    if (k > 0 && phases[k].when && !phases[k].when(problem, options, total)) continue;
    Options o = options;
    if (k > 0 && !phases[k].afresh) o.x0 = total.x;
    o.deadline = options.deadline - total.time;
    const std::size_t left = options.max_iterations ? options.max_iterations - total.iterations
                                                    : std::numeric_limits<std::size_t>::max();
    o.max_iterations = phases[k].iterations;
    if (options.max_iterations) o.max_iterations = o.max_iterations ? std::min(left, o.max_iterations) : left;
    if (options.callback)
      o.callback = [&](IterationRecord record) {
        record.iteration += total.iterations, record.products += total.products, record.time += total.time;
        return options.callback(record);
      };
    Solution part = phases[k].method(problem, o);
    append_history(total, part);
    const bool better = k == 0 || part.residual <= total.residual;
    if (better) {
      total.x = std::move(part.x), total.u = std::move(part.u);
      total.residual = part.residual, total.objective = part.objective;
      total.method = part.method;
    }
    total.status = total.residual <= options.tolerance ? Status::converged : part.status;
    if (total.status == Status::converged && total.residual > options.tolerance)
      total.status = Status::stalled;
    // The limit of a phase is none of the caller's: after the last phase it means that nothing more helps.
    if (total.status == Status::iteration_limit && part.iterations < left) total.status = Status::stalled;
    total.iterations += part.iterations;
    total.products += part.products;
    total.factorizations += part.factorizations;
    total.time += part.time;
    const bool out = options.max_iterations && total.iterations >= options.max_iterations;
    if (total.status == Status::converged || part.status == Status::interrupted ||
        part.status == Status::deadline || part.status == Status::infeasible || out ||
        total.time >= options.deadline)
      break;
  }
  // The limit of the last phase is not the caller's: there is nothing left to try.
  if (total.status == Status::iteration_limit && total.iterations < options.max_iterations)
    total.status = Status::stalled;
  return total;
}

}  // namespace amontons
