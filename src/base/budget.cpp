#include "amontons/base/budget.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace amontons {

namespace {

thread_local Budget* innermost = nullptr;

// Time between two calls of the caller's function. In Python each takes the lock of the interpreter, which
// another thread may hold for 5 ms. A delay of 20 ms after Ctrl-C is not noticeable.
constexpr std::chrono::milliseconds poll_period{20};

// A step or solve that is shorter makes no call at all.
Budget::Clock::time_point after(Budget::Clock::time_point now, double seconds) {
  constexpr double longest = 1e8;  // s, three years: beyond it the clock would overflow
  if (!(seconds < longest)) return Budget::Clock::time_point::max();
  return now + std::chrono::duration_cast<Budget::Clock::duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

Budget::Budget(double seconds, std::function<bool()> interrupt, Catches catches, double work)
    : outer_(innermost),
      polled_at_(Clock::now()),
      interrupt_(std::move(interrupt)),
      work_(work),
      catches_(catches == Catches::yes || (outer_ && outer_->catches_)) {
  end_ = after(polled_at_, seconds);
  if (outer_ && outer_->end_ < end_) end_ = outer_->end_;
  innermost = this;
}

Budget::~Budget() { innermost = outer_; }

bool Budget::stop(Clock::time_point now) {
  if (stopped_) return true;
  if (outer_ && outer_->stop(now)) return stopped_ = true;
  if (!interrupt_ || now - polled_at_ < poll_period) return false;
  polled_at_ = now;
  return stopped_ = interrupt_();
}

bool Budget::interrupted() { return innermost && innermost->stop(Clock::now()); }

bool Budget::late() { return innermost && innermost->end_ < Clock::now(); }

double Budget::left() {
  if (!innermost || innermost->end_ == Clock::time_point::max())
    return std::numeric_limits<double>::infinity();
  return std::max(0.0, std::chrono::duration<double>(innermost->end_ - Clock::now()).count());
}

void Budget::limit_work(double work) {
  if (innermost) innermost->work_ = work;
}

void Budget::spend(double work) {
  for (Budget* p = innermost; p; p = p->outer_) p->work_ -= work;
}

double Budget::work_left() {
  double least = infinite_work;
  for (const Budget* p = innermost; p; p = p->outer_) least = std::min(least, p->work_);
  return least;
}

void Budget::leave_if_due(double seconds) {
  if (!innermost || !innermost->catches_) return;
  if (interrupted()) throw LeftEarly{true};
  if (left() <= seconds) throw LeftEarly{false};
}

}  // namespace amontons
