#pragma once
#include <cstddef>

#include "amontons/base/budget.hpp"

namespace amontons {

// Work without intermediate results, such as a factorisation, calls leave_if_due(). It throws LeftEarly to
// the loop that made the innermost LeaveScope of the thread, if that loop's budget is spent or the caller
// asks to stop. Without a scope it does nothing, since nobody would catch it.
class LeaveScope {
 public:
  explicit LeaveScope(const Budget& budget);
  ~LeaveScope();
  LeaveScope(const LeaveScope&) = delete;
  LeaveScope& operator=(const LeaveScope&) = delete;

 private:
  friend void leave_if_due(double seconds);
  const Budget& budget_;
  const LeaveScope* outer_;
};

// Thrown by work that ends before it is done.
struct LeftEarly {
  bool interrupted;  // otherwise late
};

// seconds: time that the work will take before its next call.
void leave_if_due(double seconds = 0);
// For loops with short passes: reads the clock in one of some hundred calls, by the caller's counter `pass`.
inline void leave_if_due_at(std::size_t pass) {
  if (pass % 512 == 511) leave_if_due();
}

}  // namespace amontons
