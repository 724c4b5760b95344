#pragma once
#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// What a method may use up where the caller sets no limit of its own. First-order iterations cost
// microseconds and gain little each, steps with a factorisation cost milliseconds and gain much: hence a
// hundred thousand of the ones and some hundreds of the others.
struct Limits {
  std::size_t iterations;
  // Iterations without an improvement of the best residual by 1 % after which the method counts as stalled.
  // The residual of first-order methods rises and falls over thousands of iterations before it goes on
  // falling, so that their window is a tenth of their limit.
  std::size_t stall_window;
  // Steps between two evaluations of u from scratch. A method that updates u by the product with its step
  // gathers one rounding error per step; the refresh keeps their sum small beside the tolerance. 0: u is
  // always fresh.
  std::size_t refresh_period;
};

using Time = std::chrono::steady_clock::time_point;
inline double seconds_since(Time start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Counts, clock, limits, history, callback, stagnation of one solve. `options` must outlive it.
class Monitor {
 public:
  Monitor(const Options& options, const Limits& limits);

  // Once per iteration, with the natural residual of the iterate; a status means stop. Convergence is asked
  // first: an iterate that meets the tolerance is never reported as late or interrupted.
  std::optional<Status> observe(double residual, double objective, double step, std::size_t backtracks);
  // True if the residual of the last observe() was the best so far.
  bool improved() const { return improved_; }
  double best() const { return best_; }
  std::size_t iterations() const { return iterations_; }
  double elapsed() const { return seconds_since(start_); }
  // For methods with long work between two observe().
  bool out_of_time() const { return elapsed() > options_.deadline; }
  // A solve inside this one was interrupted: the next observe() says so.
  void interrupt() { stopped_ = true; }

  // The method counts its work here.
  std::size_t products = 0, factorizations = 0;
  std::vector<IterationRecord> history;

 private:
  const Options& options_;
  Time start_;
  std::size_t limit_, stall_window_, iterations_ = 0, last_progress_ = 0;
  // milestone_: the best residual at iteration last_progress_, the last that was 1 % below the one before.
  double best_ = std::numeric_limits<double>::infinity(), milestone_ = best_, last_poll_ = 0;
  bool improved_ = false, stopped_ = false;
};

// A point and its velocity u = A x + b, with the numerator of the natural residual (the natural map).
struct Start {
  std::vector<double> x, u;
  double map;
};
// Pi_K(x0), or 0 when x0 is absent or its residual is not below that of 0: a warm start is never worse than a
// cold one.
Start starting_point(const Problem& problem, const Options& options, Monitor& monitor);

// u := A x + b, one product; returns the natural map.
double evaluate(const Problem& problem, Law law, const std::vector<double>& x, std::vector<double>& u,
                Monitor& monitor);
// 1/2 x'Ax + b'x with u = A x + b
double objective(const Problem& problem, const std::vector<double>& x, const std::vector<double>& u);

// Sets u, objective and residual of s.x, by one product that the caller counts.
void measure(const Problem& problem, Law law, Solution& s);

// The end of every solve: u and the residual of x from a fresh product; the status that follows (a residual
// at or below the tolerance is `converged` whatever stopped the method); for a solve that failed, the search
// for a certificate of infeasibility, along which the last iterate runs off. An empty `last` skips it.
Solution finish(const Problem& problem, const Options& options, const char* method, std::vector<double> x,
                std::span<const double> last, Status status, Monitor& monitor);

// InputError if d'Ad is negative beyond rounding, relative to d'Pd: A is then not positive semidefinite.
void require_curvature(double dAd, double dPd);

// The solve that all methods share. A method supplies its step:
//
//   name, limits         constants
//   start(s)             takes over the start; returns the natural map of its first iterate
//   step()               one iteration; the natural map of the new iterate, or nothing when no progress is
//                        possible
//   refresh()            the natural map after u was formed from scratch, without the rounding that running
//                        sums gather; only where limits.refresh_period > 0
//   keep_best(), best(x) keeps the current iterate; gives back the one kept
//   last(x)              the current iterate
//   objective()          1/2 x'Ax + b'x of the current iterate
//   step_size(), backtracks()   for the history
//
// The vector that comes back is the best one seen by the residual, never the last: the fallback of P-SPG-FB
// (Tasora 2013). Residuals of spectral and accelerated steps rise and fall, and under coulomb no method is
// proven to converge; with the fallback more iterations never make the answer worse, so that it is safe to
// stop any method early and to try another after it. The measure is the residual and not the objective: that
// is what the caller asked for, it is comparable between methods, and under coulomb there is no objective.
//
// u is refreshed after every refresh_period steps, and before convergence is believed: a running u may say
// that the tolerance is reached where the true one does not.
template <class Method>
Solution drive(const Problem& problem, const Options& options, Method&& method, Monitor& monitor) {
  const double scale = natural_map_at_zero(problem, options.law);
  Start start = starting_point(problem, options, monitor);
  const double at_start = start.map / scale;
  if (at_start <= options.tolerance) {  // most methods would leave a solution again before they return
    monitor.observe(at_start, objective(problem, start.x, start.u), method.step_size(), 0);
    return finish(problem, options, method.name, std::move(start.x), {}, Status::converged, monitor);
  }
  const bool watched = options.history || options.callback;
  // From here on `start.x` serves as the answer of a method that never gets below it.
  bool kept = false;
  double r = method.start(start) / scale;
  Status status = Status::stalled;
  for (std::size_t stale = 0;;) {  // steps since u was fresh
    const bool due = stale >= method.limits.refresh_period || r <= options.tolerance;
    if (method.limits.refresh_period > 0 && stale > 0 && due) {
      r = method.refresh() / scale;
      stale = 0;
    }
    // The objective may cost a pass over memory: it is only formed for those who look at it.
    const auto stop =
        monitor.observe(r, watched ? method.objective() : 0.0, method.step_size(), method.backtracks());
    if (monitor.improved() && r < at_start) {
      method.keep_best();
      kept = true;
    }
    if (stop) {
      status = *stop;
      break;
    }
    const std::optional<double> next = method.step();
    if (!next) break;
    r = *next / scale;
    ++stale;
  }
  // The last iterate, not the best, runs off along a contradiction if there is one.
  std::vector<double> last(start.x.size());
  method.last(last);
  if (kept) method.best(start.x);
  return finish(problem, options, method.name, std::move(start.x), last, status, monitor);
}

// The same for a method that is made from the problem, the options and the monitor alone.
template <class Method>
Solution drive(const Problem& problem, const Options& options) {
  Monitor monitor(options, Method::limits);
  return drive(problem, options, Method(problem, options, monitor), monitor);
}

// The iterate of methods on plain vectors, which inherit it and add step(): what drive() asks for besides,
// for a u that belongs to x at the end of every step. x in K always; u = A x + b; kept, the best x.
struct VectorIterate {
  const Problem& problem;
  const Options& options;
  Monitor& monitor;
  std::vector<double> x, u, kept;

  VectorIterate(const Problem& p, const Options& o, Monitor& m) : problem(p), options(o), monitor(m) {}
  double start(const Start& s) {
    x = s.x;
    u = s.u;
    return s.map;
  }
  double evaluate() { return amontons::evaluate(problem, options.law, x, u, monitor); }
  double refresh() { return evaluate(); }
  void keep_best() { kept = x; }
  void best(std::vector<double>& out) const { out = kept; }
  void last(std::vector<double>& out) const { out = x; }
  double objective() const { return amontons::objective(problem, x, u); }
  double step_size() const { return 0; }
  std::size_t backtracks() const { return 0; }
};

}  // namespace amontons
