#pragma once
#include <chrono>
#include <limits>

namespace amontons {

// Limits of work, passed by reference to all that shares them: a time, and an amount of work. Work is counted
// and not timed, so that its limit does not make results depend on the clock. Its unit is one block of a
// product with A, some 20 ns.
//
// A part of a budget ends no later than the whole, and the whole pays for what its parts spend.
class Budget {
 public:
  static constexpr double unlimited = std::numeric_limits<double>::infinity();
  // Multiplications of dense kernels per unit of work.
  static constexpr double multiplications = 80;

  // seconds, work: allowance from now on.
  explicit Budget(double seconds = unlimited, double work = unlimited);
  // A part of `whole`, which must outlive it.
  Budget(Budget& whole, double seconds, double work = unlimited);
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;
  // Parts with this share of the time, or of the work, that is left now.
  Budget part_of_time(double share) { return Budget(*this, share * left()); }
  Budget part_of_work(double share) { return Budget(*this, unlimited, share * work_left()); }

  // Time left (s), not below zero. Reads the clock only if there is a limit.
  double left() const;
  bool late() const { return ends_within(0); }
  // Whether no time is left after `seconds` more.
  bool ends_within(double seconds) const { return left() <= seconds; }
  // Sets the limit of work from now on, where its amount is known only later; a limit that is there stays.
  void limit_work(double work);
  void spend(double work);
  double work_left() const;
  // Work that this budget and its parts have paid for.
  double spent() const { return spent_; }
  bool exhausted() const { return work_left() <= 0; }

 private:
  using Clock = std::chrono::steady_clock;

  Budget* whole_ = nullptr;
  Clock::time_point end_;
  double work_, spent_ = 0;
};

}  // namespace amontons
