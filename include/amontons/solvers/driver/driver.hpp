#pragma once
#include <algorithm>
#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "amontons/base/budget.hpp"
#include "amontons/base/interrupt.hpp"
#include "amontons/base/leave.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// Limits of a method where the caller sets none. A first-order iteration costs microseconds and gains little;
// a step with a factorisation costs milliseconds and gains much. Hence a limit of a hundred thousand for the
// former and of some hundreds for the latter.
struct Limits {
  std::size_t iterations;
  // Iterations without an improvement of the best residual by 1 % after which the method counts as stalled.
  // The residual of first-order methods can rise and fall over thousands of iterations before it falls
  // further. Their window is therefore a tenth of their limit.
  std::size_t stall_window;
  // Steps between two evaluations of u from scratch; 0 if u is always fresh. A method that updates u by the
  // product with its step sums one rounding error per step. The refresh keeps their sum small beside the
  // tolerance.
  std::size_t refresh_period;
};

using Time = std::chrono::steady_clock::time_point;
inline double seconds_since(Time start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Work (units of Budget) of an iteration with one product: a part for each block, and a constant part for
// calls and short vectors. A matrix has a part for each of its entries, too, because its product takes all.
// Cones other than Friction have no fused passes, and project by iterations of their own.
inline double work_of_iteration(const Problem& problem) {
  constexpr double beside = 16, other_cone = 6;
  double work = beside + static_cast<double>(problem.K.blocks());
  std::visit(
      [&](const auto& A) {
        if constexpr (requires { A.data.size(); })
          work += static_cast<double>(A.data.size()) / Budget::multiplications;
      },
      problem.A);
  for (const SetRun& run : problem.K.runs())
    visit_kind(run.kind, [&]<class S>() {
      if constexpr (S::frictional && !std::is_same_v<S, Friction>)
        work += (other_cone - 1) * static_cast<double>(run.count);
    });
  return work;
}

// Counts iterations and work, checks limits, records history, calls the callback and detects stagnation in
// one solve. `options` and `budget` must outlive it.
class Monitor {
 public:
  Monitor(const Options& options, const Limits& limits, Budget& budget);

  // Called once per iteration, with the natural residual of the iterate; a status means stop. Convergence is
  // tested first: an iterate that meets the tolerance is never reported as late or interrupted.
  std::optional<Status> observe(double residual, double objective, double step, std::size_t backtracks);
  // True if the residual of the last observe() was the best so far.
  bool improved() const { return improved_; }
  // Iterations that may still be made, the one that observe() allowed included.
  std::size_t left() const { return limit_ - iterations_ + 1; }
  double best() const { return best_; }
  std::size_t iterations() const { return iterations_; }
  double elapsed() const { return seconds_since(start_); }
  Time started() const { return start_; }
  // Limits of the solve, which solves inside this one share.
  Budget& budget() { return budget_; }
  // Charges the products since the last call to the budget, at `per_product` units each.
  void pay(double per_product) {
    budget_.spend(static_cast<double>(products - paid_) * per_product);
    paid_ = products;
  }
  void count_factorization(double multiplications) {
    ++factorizations;
    budget_.spend(multiplications / Budget::multiplications);
  }
  // A solve inside this one was interrupted: the next observe() returns `interrupted`.
  void interrupt() { stopped_ = true; }

  // The method counts its work here.
  std::size_t products = 0, factorizations = 0;
  std::vector<IterationRecord> history;

 private:
  const Options& options_;
  Budget& budget_;
  Time start_;
  std::size_t limit_, stall_window_, iterations_ = 0, last_progress_ = 0, paid_ = 0;
  // milestone_: the best residual at iteration last_progress_, when it last fell by 1 %.
  double best_ = std::numeric_limits<double>::infinity(), milestone_ = best_;
  bool improved_ = false, stopped_ = false;
};

// A point and its velocity u = A x + b, with the numerator of the natural residual (the natural map) and, for
// the method, the denominator (that at zero impulses).
struct Start {
  std::vector<double> x, u;
  double map, scale = 1;
};
// Returns Pi_K(x0) if x0 is given and its natural map is below a multiple of that of 0 (worst_start in
// driver.cpp). Otherwise returns Pi_K(0).
Start starting_point(const Problem& problem, const Options& options, Monitor& monitor);

// u := A x + b, one product by so many threads; returns the natural map.
double evaluate(const Problem& problem, Law law, const std::vector<double>& x, std::vector<double>& u,
                Monitor& monitor, unsigned threads = 1);
// 1/2 x'Ax + b'x with u = A x + b
double objective(const Problem& problem, const std::vector<double>& x, const std::vector<double>& u);

// Forms u, the objective and the residual of s.x by one product, which the caller counts.
void form_velocities(const Problem& problem, Solution& s, unsigned threads = 1);
void measure(const Problem& problem, Law law, Solution& s, unsigned threads = 1);

// The results of a method; x is its best. After a failed solve `last`, the last iterate, serves to find a
// certificate of infeasibility, because it diverges along one. An empty `last` skips this search.
struct End {
  const char* method;
  Status status;
  std::vector<double> x;
  std::span<const double> last;
};

// Ends every solve. Forms u and the residual of x by a fresh product. A residual at or below the tolerance
// gives `converged`, whatever stopped the method.
Solution finish(const Problem& problem, const Options& options, End end, Monitor& monitor);

// InputError if d'Ad is negative beyond rounding, relative to d'Pd: A is then not positive semidefinite.
void require_curvature(double dAd, double dPd);

// A solve that can be suspended and resumed: it keeps its state between two turns.
class Run {
 public:
  Run() = default;
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  virtual ~Run() = default;
  // Continues for `iterations` iterations or until the solve ends; true if it has ended.
  virtual bool advance(std::size_t iterations) = 0;
  virtual const char* name() const = 0;
  // The best x so far and its residual, which is infinite before the first advance().
  virtual double best_residual() const = 0;
  virtual void best(std::vector<double>& x) const = 0;
  virtual std::size_t iterations() const = 0;
  virtual std::size_t products() const = 0;
  virtual std::size_t factorizations() const = 0;
  // The time from which its records count.
  virtual Time started() const = 0;
  // The records so far; empty unless options.history.
  virtual const std::vector<IterationRecord>& history() const = 0;
  // Ends the solve; called once. Returns the best x, with its residual from a fresh product.
  virtual Solution finish() = 0;
};

// Makes a run. Its arguments must outlive it.
using Starter = std::unique_ptr<Run> (*)(const Problem&, const Options&, Budget&);
// Runs to the end.
inline Solution complete(std::unique_ptr<Run> run) {
  run->advance(std::numeric_limits<std::size_t>::max());
  return run->finish();
}

// The loop that all methods share. A method supplies its step:
//
//   name, limits         constants
//   start(s)             takes over the start; returns the natural map of its first iterate
//   step()               one iteration; returns the natural map of the new iterate, or std::nullopt if no
//                        progress is possible
//   refresh()            forms u from scratch, without the rounding that updates accumulate; returns the
//                        natural map; only needed if limits.refresh_period > 0
//   keep_best(), best(x) stores the current iterate; returns the stored one
//   last(x)              the current iterate
//   objective()          1/2 x'Ax + b'x of the current iterate
//   step_size(), backtracks()   for the history
//
// The result is the iterate with the smallest residual, not the last: the fallback of P-SPG-FB (Tasora 2013).
// Residuals of spectral and accelerated steps rise and fall, and under coulomb no method is proven to
// converge. With the fallback more iterations never make the answer worse. It is therefore safe to stop a
// method early and to try another one. The measure is the residual and not the objective: the caller asked
// for it, methods can be compared by it, and under coulomb there is no objective.
//
// u is refreshed after every refresh_period steps and before convergence is accepted: an updated u can meet
// the tolerance where the true u does not.
template <class Method>
class Driven final : public Run {
 public:
  // make(options, monitor) returns the method. Both arguments live as long as the run.
  Driven(const Problem& problem, const Options& options, Budget& budget, auto&& make)
      : problem_(problem), options_(options), monitor_(options_, Method::limits, budget) {
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
          assess_iterate();
        }
      }
    });
    return status_.has_value();
  }
  const char* name() const override { return Method::name; }
  double best_residual() const override { return monitor_.best(); }
  void best(std::vector<double>& x) const override {
    x = best_;  // the start; this also sets the size
    if (kept_) method_->best(x);
  }
  // The monitor also counts the step that it allows but that has not been made.
  std::size_t iterations() const override { return monitor_.iterations() - (started_ && !status_ ? 1 : 0); }
  std::size_t products() const override { return monitor_.products; }
  std::size_t factorizations() const override { return monitor_.factorizations; }
  Time started() const override { return monitor_.started(); }
  const std::vector<IterationRecord>& history() const override { return monitor_.history; }

  Solution finish() override {
    if (!started_) begin();
    // If the rows contradict each other the last iterate, not the best, diverges along the contradiction. A
    // start that is the solution shows none. A solve that was stopped early may be in the middle of a step.
    std::vector<double> last;
    if (!at_solution_ && !left_) {
      last.resize(best_.size());
      method_->last(last);
    }
    if (kept_) method_->best(best_);
    Solution s =
        amontons::finish(problem_, options_,
                         {Method::name, status_.value_or(Status::stalled), std::move(best_), last}, monitor_);
    s.iterations = iterations();
    return s;
  }

 private:
  // Runs work that factors. It is abandoned when the time is up or the user interrupts. The answer is then
  // the best x so far; without a first iterate, or without a method, it is the start.
  void unless_left(auto&& work) {
    const LeaveScope scope(monitor_.budget());
    try {
      work();
    } catch (const LeftEarly& early) {
      left_ = true;
      status_ = early.interrupted ? Status::interrupted : Status::deadline;
    }
  }

  // A start that meets the tolerance is the answer: most methods would leave it before they return to it.
  void begin() {
    started_ = true;
    scale_ = natural_map_at_zero(problem_, law_of(problem_, options_));
    Start start = starting_point(problem_, options_, monitor_);
    start.scale = scale_;
    at_start_ = start.map / scale_;
    if (at_start_ <= options_.tolerance) {
      monitor_.observe(at_start_, amontons::objective(problem_, start.x, start.u),
                       method_ ? method_->step_size() : 0, 0);
      at_solution_ = true;
      status_ = Status::converged;
    } else if (method_) {
      unless_left([&] {
        residual_ = method_->start(start) / scale_;
        assess_iterate();
      });
    }
    // From here on it is the answer of a method that never reaches a smaller residual.
    best_ = std::move(start.x);
  }

  // After each iterate: refresh if due, record, keep the best, stop.
  void assess_iterate() {
    constexpr const Limits& limits = Method::limits;
    const bool due = stale_ >= limits.refresh_period || residual_ <= options_.tolerance;
    if (limits.refresh_period > 0 && stale_ > 0 && due) {
      residual_ = method_->refresh() / scale_;
      stale_ = 0;
    }
    monitor_.pay(work_);
    // The objective may cost a pass over memory. It is only formed if somebody reads it.
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
std::unique_ptr<Run> drive(const Problem& problem, const Options& options, Budget& budget) {
  return std::make_unique<Driven<Method>>(problem, options, budget, [&](const Options& o, Monitor& monitor) {
    return Method(problem, o, monitor);
  });
}

// The iterate of methods on plain vectors, which inherit it and add step(). It supplies the rest of what
// drive() needs, for methods in which u belongs to x at the end of every step. Invariants: x in K, u = A x +
// b.
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
