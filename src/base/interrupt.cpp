#include "amontons/base/interrupt.hpp"

#include <utility>

#include "amontons/base/leave.hpp"

namespace amontons {

namespace {

thread_local Interrupt* innermost = nullptr;
thread_local const LeaveScope* scope = nullptr;

// Time between two calls of the caller's function. In Python each takes the lock of the interpreter, which
// another thread may hold for 5 ms. A delay of 20 ms after Ctrl-C is not noticeable. A step or solve that is
// shorter makes no call at all.
constexpr std::chrono::milliseconds poll_period{20};

}  // namespace

Interrupt::Interrupt(std::function<bool()> requested)
    : outer_(innermost), polled_at_(Clock::now()), requested_(std::move(requested)) {
  innermost = this;
}

Interrupt::~Interrupt() { innermost = outer_; }

bool Interrupt::asks(Clock::time_point now) {
  if (stopped_) return true;
  if (outer_ && outer_->asks(now)) return stopped_ = true;
  if (!requested_ || now - polled_at_ < poll_period) return false;
  polled_at_ = now;
  return stopped_ = requested_();
}

bool Interrupt::requested() { return innermost && innermost->asks(Clock::now()); }

LeaveScope::LeaveScope(const Budget& budget) : budget_(budget), outer_(scope) { scope = this; }

LeaveScope::~LeaveScope() { scope = outer_; }

void leave_if_due(double seconds) {
  if (!scope) return;
  if (Interrupt::requested()) throw LeftEarly{true};
  if (scope->budget_.ends_within(seconds)) throw LeftEarly{false};
}

}  // namespace amontons
