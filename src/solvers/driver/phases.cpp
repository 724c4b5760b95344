#include "amontons/solvers/driver/phases.hpp"

#include <cmath>
#include <cstdio>
#include <utility>

namespace amontons {

void add_counts(Solution& total, const Solution& part) {
  total.iterations += part.iterations;
  total.products += part.products;
  total.factorizations += part.factorizations;
}

void join(Solution& total, Solution part) {
  add_counts(total, part);
  total.time += part.time;
  total.phases.insert(total.phases.end(), part.phases.begin(), part.phases.end());
  if (!total.x.empty() && !(part.residual < total.residual || std::isnan(total.residual))) return;
  total.x = std::move(part.x);
  total.u = std::move(part.u);
  total.residual = part.residual;
  total.objective = part.objective;
  total.method = std::move(part.method);
  total.device = std::move(part.device);
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

}  // namespace amontons
