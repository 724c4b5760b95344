#pragma once
#include <algorithm>
#include <chrono>

#include "amontons/base/budget.hpp"
#include "amontons/multibody/model/description.hpp"
#include "amontons/multibody/step/report.hpp"

namespace amontons {

// The wall clock of a step: laps of its phases, and the budget of all its work.
// Results never depend on it unless there is a budget.
class StepClock {
 public:
  using Clock = std::chrono::steady_clock;
  // seconds: of the step. reserved: of these for work that cannot be interrupted, at most half.
  explicit StepClock(double seconds, double reserved = 0)
      : seconds_(seconds - std::min(reserved, most_reserved * seconds)),
        budget(seconds_),
        start_(Clock::now()),
        lap_(start_) {}
  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  // Adds the time since the last lap: every moment of a step belongs to one phase.
  void lap(double Timings::* phase) {
    const Clock::time_point now = Clock::now();
    timings.*phase += std::chrono::duration<double>(now - lap_).count();
    lap_ = now;
  }
  // Stores the end of the last solve, or its deadline if it began `in_time` and ended later. The time since
  // then is the time to reserve (s).
  void solved(bool in_time) { solved_ = in_time ? std::min(elapsed(), seconds_) : elapsed(); }
  double since_solved() const { return elapsed() - solved_; }
  // Whether the budget ends within another attempt, solve excluded.
  bool over_attempt() const {
    return budget.ends_within(timings.assembly + timings.collision + timings.integration);
  }

 private:
  // Time (relative to the budget): most that is reserved for work that cannot be interrupted.
  static constexpr double most_reserved = 0.5;
  double seconds_, solved_ = 0;

 public:
  Budget budget;
  Timings timings;    // of the present attempt; `total` stays 0
  double search = 0;  // s: time of a search for contacts; setting up a method takes about as long

 private:
  Clock::time_point start_, lap_;
};

}  // namespace amontons
