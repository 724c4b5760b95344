#pragma once
#include <chrono>
#include <cstddef>
#include <functional>
#include <limits>

namespace amontons {

// Limits of the work on this thread: a deadline, an amount of work, and an interrupt by the caller. Work is
// counted and not timed, so that its limit does not make results depend on the clock. Its unit is one block
// of a product with A, some 20 ns. A limit is set by a Budget on the stack. Long work checks the innermost
// Budget, which includes the outer ones. So a factorisation within a solve within a step within a rollout
// ends when the user presses Ctrl-C, and no function needs an argument for it.
//
// A loop that keeps its best result checks late() or interrupted(). Work without intermediate results, such
// as a factorisation, calls leave_if_due(), which throws LeftEarly to the enclosing loop.
class Budget {
 public:
  using Clock = std::chrono::steady_clock;
  // Whether the loop that makes this Budget catches LeftEarly.
  enum class Catches : bool { no, yes };
  static constexpr double infinite_work = std::numeric_limits<double>::infinity();
  // Multiplications of dense kernels per unit of work.
  static constexpr double multiplications = 80;

  // seconds, work: allowance from now on, may be infinite. interrupt: returns true to interrupt, which is
  // permanent; it may be empty, or throw. It is called on this thread, at most every 20 ms.
  explicit Budget(double seconds, std::function<bool()> interrupt = {}, Catches catches = Catches::no,
                  double work = infinite_work);
  ~Budget();
  Budget(const Budget&) = delete;
  Budget& operator=(const Budget&) = delete;

  static bool interrupted();
  static bool late();
  // Time left (s), infinite without a limit; not below zero.
  static double left();
  // For loops with short passes: reads the clock in one of some hundred calls, by the caller's counter
  // `pass`.
  static void leave_if_due_at(std::size_t pass) {
    if (pass % 512 == 511) leave_if_due();
  }
  // Sets the work limit of the innermost scope from now on, if its amount is known only after the scope
  // began.
  static void limit_work(double work);
  static void spend(double work);
  static double work_left();
  static bool exhausted() { return work_left() <= 0; }
  // Throws LeftEarly if the work was interrupted, is late or would be late after `seconds` more. Does nothing
  // without a loop that catches it.
  static void leave_if_due(double seconds = 0);

 private:
  bool stop(Clock::time_point now);

  Budget* outer_;
  Clock::time_point end_, polled_at_;
  std::function<bool()> interrupt_;
  double work_;
  bool stopped_ = false, catches_;
};

// Thrown by work that ends before it is done.
struct LeftEarly {
  bool interrupted;  // otherwise late
};

}  // namespace amontons
