#include "amontons/base/budget.hpp"

#include <algorithm>

namespace amontons {

namespace {

std::chrono::steady_clock::time_point in(double seconds) {
  using Clock = std::chrono::steady_clock;
  constexpr double longest = 1e8;  // s, three years: beyond it the clock would overflow
  if (!(seconds < longest)) return Clock::time_point::max();
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

}  // namespace

// A part ends at the earlier of the two ends, so that late() looks at one of them. Work has no such shortcut:
// the whole may be spent by another part.
Budget::Budget(double seconds, double work) : end_(in(seconds)), work_(work) {}

Budget::Budget(Budget& whole, double seconds, double work)
    : whole_(&whole), end_(std::min(whole.end_, in(seconds))), work_(work) {}

double Budget::left() const {
  if (end_ == Clock::time_point::max()) return unlimited;
  return std::max(0.0, std::chrono::duration<double>(end_ - Clock::now()).count());
}

void Budget::limit_work(double work) {
  if (work_ == unlimited) work_ = work;
}

// Work is counted with or without a limit: it compares methods where clocks differ, because of the machine,
// its other load, or the build.
void Budget::spend(double work) {
  for (Budget* p = this; p; p = p->whole_) {
    p->work_ -= work;
    p->spent_ += work;
  }
}

// The least along the chain of wholes, of which there are three or four: solve, step, attempt.
double Budget::work_left() const {
  double least = unlimited;
  for (const Budget* p = this; p; p = p->whole_) least = std::min(least, p->work_);
  return least;
}

}  // namespace amontons
