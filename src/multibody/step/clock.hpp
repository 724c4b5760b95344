#pragma once
#include <algorithm>
#include <chrono>

#include "amontons/multibody/model/description.hpp"
#include "amontons/multibody/step/report.hpp"

namespace amontons {

// The wall clock of a step: laps of its phases, and the rest of its budget.
// Results never depend on it unless there is a budget.
class StepClock {
 public:
  using Clock = std::chrono::steady_clock;
  explicit StepClock(double budget) : whole_(budget), budget_(budget), start_(Clock::now()), lap_(start_) {}
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  // Adds the time since the last lap: every moment of a step belongs to one phase.
  void lap(double Timings::* phase) {
    const Clock::time_point now = Clock::now();
    timings.*phase += std::chrono::duration<double>(now - lap_).count();
    lap_ = now;
  }
  // Reserves time (s) for work that cannot be interrupted, at most half of the budget.
  void keep_free(double time) { budget_ = std::min(budget_, whole_ - std::min(time, most_free * whole_)); }
  // Reserves a share of the remaining time for the work after the next solve; 0 cancels the reservation.
  void set_aside(double share) {
    aside_ = 0;
    if (share > 0 && budget_ < infinity) aside_ = share * left();
  }
  // Stores the end of the last solve, or its deadline if it began `in_time` and ended later. The time since
  // then is the time to reserve (s).
  void solved(bool in_time) { solved_ = in_time ? std::min(elapsed(), budget_) : elapsed(); }
  double since_solved() const { return elapsed() - solved_; }
  // Time for the deadline of a solve (s): positive even when the budget is spent, infinite without a budget.
  double left() const {
    constexpr double moment = 1e-6;  // not tuned: s
    return budget_ < infinity ? std::max(moment, budget_ - aside_ - elapsed()) : infinity;
  }
  // Whether the budget ends within `more` (s).
  bool over(double more = 0) const { return budget_ < infinity && elapsed() + more >= budget_ - aside_; }
  // Whether the budget ends within another attempt, solve excluded.
  bool over_attempt() const { return over(timings.assembly + timings.collision + timings.integration); }

  Timings timings;    // of the present attempt; `total` stays 0
  double search = 0;  // s: time of a search for contacts; setting up a method takes about as long

 private:
  // Time (relative to the budget): most that is reserved for work that cannot be interrupted.
  static constexpr double most_free = 0.5;
  double whole_, budget_, aside_ = 0, solved_ = 0;
  Clock::time_point start_, lap_;
};

}  // namespace amontons
