#include "amontons/solvers/driver/start.hpp"

#include <utility>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

void begin_at(const Problem& problem, std::span<const double> x0, Solution& s, unsigned threads) {
  s.x.resize(problem.rows());
  project(problem.K, x0, s.x);
  form_velocities(problem, s, threads);
}

void measure_start(const Problem& problem, const Options& options, Solution& s) {
  begin_at(problem, options.x0, s, options.threads);
  s.residual = residual(problem, law_of(problem, options), s.x, s.u);
}

// Nothing else of an earlier solve whose arrays the start has goes on: no counts, phases or reason.
Solution accepted(Solution start, const char* method) {
  Solution s;
  s.x = std::move(start.x);
  s.u = std::move(start.u);
  s.objective = start.objective;
  s.residual = start.residual;
  s.status = Status::converged;
  s.products = 1;
  s.method = method;
  return s;
}

}  // namespace amontons
