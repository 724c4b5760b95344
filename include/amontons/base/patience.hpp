#pragma once
#include <chrono>
#include <cstddef>
#include <functional>
#include <limits>

namespace amontons {

// How long the work on this thread may last: until a moment, until so much work is done, and until somebody
// says stop. Work is counted and not timed, so that its limit does not make results depend on the clock; the
// unit is one block of a product with A, some 20 ns. Whoever sets such
// a limit makes a Patience on the stack, and work that takes long looks at the innermost one, which knows the
// outer ones. So a solve within a step within a rollout, and a factorisation within that, end when the user
// presses Ctrl-C, and none of their functions has an argument for it.
//
// A loop that keeps the best it has asks late() or interrupted(). Work in the middle of which nothing can be
// kept, a factorisation, calls leave_if_due(), which throws LeftEarly to the loop that it belongs to.
class Patience {
 public:
  using Clock = std::chrono::steady_clock;
  // Whether the loop that makes it catches LeftEarly.
  enum class Catches : bool { no, yes };
  static constexpr double infinite_work = std::numeric_limits<double>::infinity();
  // Multiplications of dense kernels in the time of one unit of work.
  static constexpr double multiplications = 80;

  // seconds: from now on, may be infinite. work: likewise. asked: true is the wish to stop, which stays; may
  // be empty, or throw. It is called on this thread, at most every 20 ms.
  explicit Patience(double seconds, std::function<bool()> asked = {}, Catches catches = Catches::no,
                    double work = infinite_work);
  ~Patience();
  Patience(const Patience&) = delete;
  Patience& operator=(const Patience&) = delete;

  static bool interrupted();
  static bool late();
  // s, infinite without a limit; not below zero.
  static double left();
  // Of loops with short passes: looks at the clock in one of some hundred calls, by a count of the caller's.
  static void leave_if_due_at(std::size_t pass) {
    if (pass % 512 == 511) leave_if_due();
  }
  // Of the innermost scope: work from now on, where its amount is known only later than its scope.
  static void limit_work(double work);
  static void spend(double work);
  static double work_left();
  static bool exhausted() { return work_left() <= 0; }
  // Throws if the work was interrupted, is late or would be: it takes so many seconds yet. Does nothing where
  // nobody would catch it.
  static void leave_if_due(double seconds = 0);

 private:
  bool stop(Clock::time_point now);

  Patience* outer_;
  Clock::time_point end_, asked_at_;
  std::function<bool()> asked_;
  double work_;
  bool stopped_ = false, catches_;
};

// Work that was left before it was done.
struct LeftEarly {
  bool interrupted;  // or else late
};

}  // namespace amontons
