#pragma once
#include <chrono>
#include <limits>
#include <optional>
#include <vector>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// What every method does around its iteration: clock, limits, history, callback, stagnation. A method calls
// observe() once per iteration with the natural residual of its iterate; a Status means stop.
class Monitor {
 public:
  // default_iterations: the method's limit when options.max_iterations is 0. stall_window: iterations
  // without an improvement of the best residual by 1 % after which the method counts as stalled.
  Monitor(const Options& options, std::size_t default_iterations, std::size_t stall_window);

  std::optional<Status> observe(double residual, double objective, double step = 0,
                                std::size_t backtracks = 0);
  // True if the residual of the last observe() was the best so far: the caller keeps that iterate.
  bool improved() const { return improved_; }
  double best() const { return best_; }
  std::size_t iterations() const { return iterations_; }
  double elapsed() const;
  bool out_of_time();  // for methods with long phases (a factorisation) between two observe()

  std::size_t products = 0;  // the method counts them here
  std::size_t factorizations = 0;
  std::vector<IterationRecord> history;

 private:
  const Options& options_;
  std::chrono::steady_clock::time_point start_;
  std::size_t limit_, stall_window_, iterations_ = 0, last_progress_ = 0;
  double best_ = std::numeric_limits<double>::infinity(), milestone_ = best_, last_poll_ = 0;
  bool improved_ = false;
};

// InputError if d'Ad is negative beyond rounding, relative to d'Pd: A is then not positive semidefinite.
void require_curvature(double dAd, double dPd);

// The common end of every method: u and the residual of x from a fresh product, and the status that follows
// (a residual at or below the tolerance is `converged` whatever stopped the method).
Solution finish(const Problem& problem, const Options& options, const char* method, std::vector<double> x,
                Status status, Monitor& monitor);

// The start of every method: Pi_K(x0), or 0 when x0 is absent or its residual is not below that of 0 (a warm
// start is never worse than a cold one). u = A x + b of the chosen start; returns its residual.
double starting_point(const Problem& problem, const Options& options, std::span<double> x,
                      std::span<double> u, Monitor& monitor);

}  // namespace amontons
