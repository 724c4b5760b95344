#pragma once
#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "amontons/base/patience.hpp"
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

// Of an iteration with one product, in units of Patience: the blocks, and beside them calls and vectors of a
// few entries. Cones other than Friction have no fused passes, and find the foot of a projection by
// iterations of their own.
inline double work_of_iteration(const Problem& problem) {
  constexpr double beside = 16, other_cone = 6;
  double work = beside + static_cast<double>(problem.K.blocks());
  for (const SetRun& run : problem.K.runs())
    visit_kind(run.kind, [&]<class S>() {
      if constexpr (S::frictional && !std::is_same_v<S, Friction>)
        work += (other_cone - 1) * static_cast<double>(run.count);
    });
  return work;
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
  Time started() const { return start_; }
  // For methods with long work between two observe().
  bool out_of_time() const { return elapsed() > deadline_; }
  // Charges the products since the last call to the Patience of the thread, each at so much.
  void pay(double per_product) {
    Patience::spend(static_cast<double>(products - paid_) * per_product);
    paid_ = products;
  }
  // A solve inside this one was interrupted: the next observe() says so.
  void interrupt() { stopped_ = true; }

  // The method counts its work here.
  std::size_t products = 0, factorizations = 0;
  std::vector<IterationRecord> history;

 private:
  const Options& options_;
  double deadline_;  // s, that of the options or of the Patience of the thread
  Time start_;
  std::size_t limit_, stall_window_, iterations_ = 0, last_progress_ = 0, paid_ = 0;
  // milestone_: the best residual at iteration last_progress_, the last that was 1 % below the one before.
  double best_ = std::numeric_limits<double>::infinity(), milestone_ = best_;
  bool improved_ = false, stopped_ = false;
};

// A point and its velocity u = A x + b, with the numerator of the natural residual (the natural map).
struct Start {
  std::vector<double> x, u;
  double map;
};
// Pi_K(x0), or 0 when x0 is absent or its residual is not below that of 0, or as many times it as the options
// allow.
Start starting_point(const Problem& problem, const Options& options, Monitor& monitor);

// u := A x + b, one product; returns the natural map.
double evaluate(const Problem& problem, Law law, const std::vector<double>& x, std::vector<double>& u,
                Monitor& monitor);
// 1/2 x'Ax + b'x with u = A x + b
double objective(const Problem& problem, const std::vector<double>& x, const std::vector<double>& u);

// Sets u and the objective of s.x, by one product that the caller counts; the residual, too.
void form_velocities(const Problem& problem, Solution& s);
void measure(const Problem& problem, Law law, Solution& s);

// The end of every solve: u and the residual of x from a fresh product; the status that follows (a residual
// at or below the tolerance is `converged` whatever stopped the method); for a solve that failed, the search
// for a certificate of infeasibility, along which the last iterate runs off. An empty `last` skips it.
Solution finish(const Problem& problem, const Options& options, const char* method, std::vector<double> x,
                std::span<const double> last, Status status, Monitor& monitor);

// InputError if d'Ad is negative beyond rounding, relative to d'Pd: A is then not positive semidefinite.
void require_curvature(double dAd, double dPd);

// A solve that can be left and gone on with: it keeps its state between two turns.
class Run {
 public:
  Run() = default;
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  virtual ~Run() = default;
  // Goes on for so many iterations, or until the solve ends; true if it has ended.
  virtual bool advance(std::size_t iterations) = 0;
  virtual const char* name() const = 0;
  // The best x so far and its residual, which is infinite before the first advance().
  virtual double best_residual() const = 0;
  virtual void best(std::vector<double>& x) const = 0;
  virtual std::size_t iterations() const = 0;
  virtual std::size_t products() const = 0;
  virtual std::size_t factorizations() const = 0;
  // From when the times of its records count.
  virtual Time started() const = 0;
  // The records so far; empty unless options.history.
  virtual const std::vector<IterationRecord>& history() const = 0;
  // Ends the solve: its best x, measured afresh. Once.
  virtual Solution finish() = 0;
};

// How a run is made. Problem and options must outlive it.
using Starter = std::unique_ptr<Run> (*)(const Problem&, const Options&);
// The whole of a run.
inline Solution complete(std::unique_ptr<Run> run) {
  run->advance(std::numeric_limits<std::size_t>::max());
  return run->finish();
}

// The loop that all methods share. A method supplies its step:
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
class Driven final : public Run {
 public:
  // make(options, monitor) returns the method; both live as long as the run.
  Driven(const Problem& problem, const Options& options, auto&& make)
      : problem_(problem), options_(options), monitor_(options_, Method::limits) {
    unless_left([&] { method_.reset(new Method(make(options_, monitor_))); });
  }

  bool advance(std::size_t iterations) override {
    if (!started_) begin();
    unless_left([&] {
      for (; !status_ && iterations > 0; --iterations) {
        const std::optional<double> map = method_->step();
        if (!map) {
          status_ = Status::stalled;
        } else {
          residual_ = *map / scale_;
          ++stale_;
          look();
        }
      }
    });
    return status_.has_value();
  }
  const char* name() const override { return Method::name; }
  double best_residual() const override { return monitor_.best(); }
  void best(std::vector<double>& x) const override {
    x = best_;  // the start, and the size that is needed
    if (kept_) method_->best(x);
  }
  // The monitor counts the step that it allows.
  std::size_t iterations() const override { return monitor_.iterations() - (started_ && !status_ ? 1 : 0); }
  std::size_t products() const override { return monitor_.products; }
  std::size_t factorizations() const override { return monitor_.factorizations; }
  Time started() const override { return monitor_.started(); }
  const std::vector<IterationRecord>& history() const override { return monitor_.history; }

  Solution finish() override {
    if (!started_) begin();
    // The last iterate, not the best, runs off along a contradiction if there is one. A start that is the
    // solution has none, and what was left early may be in the middle of a step.
    std::vector<double> last;
    if (!at_solution_ && !left_) {
      last.resize(best_.size());
      method_->last(last);
    }
    if (kept_) method_->best(best_);
    Solution s = amontons::finish(problem_, options_, Method::name, std::move(best_), last,
                                  status_.value_or(Status::stalled), monitor_);
    s.iterations = iterations();
    return s;
  }

 private:
  // Runs what factors, which is left where the time is up or the user wants to stop. The best so far is the
  // answer then; without a first iterate, or a method at all, it is the start.
  void unless_left(auto&& work) {
    const Patience patience(options_.deadline - monitor_.elapsed(), {}, Patience::Catches::yes);
    try {
      work();
    } catch (const LeftEarly& early) {
      left_ = true;
      status_ = early.interrupted ? Status::interrupted : Status::deadline;
    }
  }

  // The start: where it meets the tolerance it is the answer, which most methods would leave again before
  // they return.
  void begin() {
    started_ = true;
    scale_ = natural_map_at_zero(problem_, law_of(problem_, options_));
    Start start = starting_point(problem_, options_, monitor_);
    at_start_ = start.map / scale_;
    if (at_start_ <= options_.tolerance) {
      monitor_.observe(at_start_, amontons::objective(problem_, start.x, start.u),
                       method_ ? method_->step_size() : 0, 0);
      at_solution_ = true;
      status_ = Status::converged;
    } else if (method_) {
      unless_left([&] {
        residual_ = method_->start(start) / scale_;
        look();
      });
    }
    // From here on it serves as the answer of a method that never gets below it.
    best_ = std::move(start.x);
  }

  // The driver's look at an iterate: refresh where due, record, keep the best, stop.
  void look() {
    constexpr const Limits& limits = Method::limits;
    const bool due = stale_ >= limits.refresh_period || residual_ <= options_.tolerance;
    if (limits.refresh_period > 0 && stale_ > 0 && due) {
      residual_ = method_->refresh() / scale_;
      stale_ = 0;
    }
    monitor_.pay(work_);
    // The objective may cost a pass over memory: it is only formed for those who look at it.
    const bool watched = options_.history || options_.callback;
    status_ = monitor_.observe(residual_, watched ? method_->objective() : 0.0, method_->step_size(),
                               method_->backtracks());
    if (monitor_.improved() && residual_ < at_start_) {
      method_->keep_best();
      kept_ = true;
    }
  }

  const Problem& problem_;
  const Options options_;
  Monitor monitor_;
  std::unique_ptr<Method> method_;
  bool started_ = false, at_solution_ = false, kept_ = false, left_ = false;
  std::optional<Status> status_;
  std::vector<double> best_;
  // The natural map at zero; residuals of the start and of the current iterate; steps since u was fresh.
  double scale_ = 1, at_start_ = 0, residual_ = 0;
  std::size_t stale_ = 0;
  const double work_ = work_of_iteration(problem_);
};

// For a method that is made from the problem, the options and the monitor alone.
template <class Method>
std::unique_ptr<Run> drive(const Problem& problem, const Options& options) {
  return std::make_unique<Driven<Method>>(
      problem, options, [&](const Options& o, Monitor& monitor) { return Method(problem, o, monitor); });
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
  double evaluate() { return amontons::evaluate(problem, law_of(problem, options), x, u, monitor); }
  double refresh() { return evaluate(); }
  void keep_best() { kept = x; }
  void best(std::vector<double>& out) const { out = kept; }
  void last(std::vector<double>& out) const { out = x; }
  double objective() const { return amontons::objective(problem, x, u); }
  double step_size() const { return 0; }
  std::size_t backtracks() const { return 0; }
};

}  // namespace amontons
