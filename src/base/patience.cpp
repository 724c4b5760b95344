#include "amontons/base/patience.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace amontons {

namespace {

thread_local Patience* innermost = nullptr;

// Time between two calls of the caller's function. In Python each takes the lock of the interpreter, which
// another thread may hold for 5 ms. A delay of 20 ms after Ctrl-C is not noticeable.
constexpr std::chrono::milliseconds question_period{20};

// A step or solve that is shorter makes no call at all.
Patience::Clock::time_point after(Patience::Clock::time_point now, double seconds) {
  constexpr double longest = 1e8;  // s, three years: beyond it the clock would overflow
  if (!(seconds < longest)) return Patience::Clock::time_point::max();
  return now + std::chrono::duration_cast<Patience::Clock::duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

Patience::Patience(double seconds, std::function<bool()> asked, Catches catches, double work)
    : outer_(innermost),
      asked_at_(Clock::now()),
      asked_(std::move(asked)),
      work_(work),
      catches_(catches == Catches::yes || (outer_ && outer_->catches_)) {
  end_ = after(asked_at_, seconds);
  if (outer_ && outer_->end_ < end_) end_ = outer_->end_;
  innermost = this;
}

Patience::~Patience() { innermost = outer_; }

bool Patience::stop(Clock::time_point now) {
  if (stopped_) return true;
  if (outer_ && outer_->stop(now)) return stopped_ = true;
  if (!asked_ || now - asked_at_ < question_period) return false;
  asked_at_ = now;
  return stopped_ = asked_();
}

bool Patience::interrupted() { return innermost && innermost->stop(Clock::now()); }

bool Patience::late() { return innermost && innermost->end_ < Clock::now(); }

double Patience::left() {
  if (!innermost || innermost->end_ == Clock::time_point::max())
    return std::numeric_limits<double>::infinity();
  return std::max(0.0, std::chrono::duration<double>(innermost->end_ - Clock::now()).count());
}

void Patience::limit_work(double work) {
  if (innermost) innermost->work_ = work;
}

void Patience::spend(double work) {
  for (Patience* p = innermost; p; p = p->outer_) p->work_ -= work;
}

double Patience::work_left() {
  double least = infinite_work;
  for (const Patience* p = innermost; p; p = p->outer_) least = std::min(least, p->work_);
  return least;
}

void Patience::leave_if_due(double seconds) {
  if (!innermost || !innermost->catches_) return;
  if (interrupted()) throw LeftEarly{true};
  if (left() <= seconds) throw LeftEarly{false};
}

}  // namespace amontons
