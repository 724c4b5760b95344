#pragma once
#include <algorithm>
#include <chrono>

#include "amontons/base/budget.hpp"
#include "amontons/multibody/step/report.hpp"
#include "multibody/step/policy.hpp"

namespace amontons {

// The wall clock of a step: laps of its phases, and the budget of all its work.
// Results never depend on it unless there is a budget.
class StepClock {
 public:
  using Clock = std::chrono::steady_clock;
  // seconds: of the step. reserved: of these for work that cannot be interrupted, at most the share of a
  // part.
  explicit StepClock(double seconds, double reserved = 0)
      : budget(seconds - std::min(reserved, step::policy.share_of_part * seconds)), lap_(Clock::now()) {}
  // Adds the time since the last lap, and returns it: every moment of a step belongs to one phase.
  double lap(double Timings::* phase) {
    const Clock::time_point now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - lap_).count();
    timings.*phase += seconds;
    timings.total += seconds;
    lap_ = now;
    return seconds;
  }
  // Begins another attempt, whose phases count from zero; the total goes on.
  void begin_attempt() { timings = {.total = timings.total}; }
  // Whether the budget ends within another attempt, solve excluded.
  bool over_attempt() const {
    return budget.ends_within(timings.assembly + timings.collision + timings.integration);
  }

  // s: time of what may follow in a step: the search after a correction of positions, the set-up of a method,
  // which takes about as long, and the looks ahead. With less left a first-order method runs at once.
  // Positions are not corrected then, and contacts do not turn ahead (benchmarks/budgets.py).
  double searches() const { return (2 + step::policy.most_looks) * search; }

  Budget budget;
  Timings timings;             // of the present attempt; `total` of all
  double search = 0;           // s: time of a search for contacts; setting up a method takes about as long
  bool short_of_time = false;  // no time for more than the step needs, see searches()

 private:
  Clock::time_point lap_;
};

}  // namespace amontons
