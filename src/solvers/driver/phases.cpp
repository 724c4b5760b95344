#include "amontons/solvers/driver/phases.hpp"

#include <cstdio>

namespace amontons {

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

}  // namespace amontons
