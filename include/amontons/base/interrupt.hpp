#pragma once
#include <chrono>
#include <functional>

namespace amontons {

// A request of the caller to stop the work of this thread, for example by Ctrl-C. It is the only state of a
// thread: so a factorisation within a solve within a step within a rollout ends, and no function needs an
// argument for it.
class Interrupt {
 public:
  // requested: returns true to stop, which is permanent; it may be empty, or throw. It is called on this
  // thread, at most every 20 ms. Outer Interrupts of the thread are asked too.
  explicit Interrupt(std::function<bool()> requested);
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  // Whether the caller of this thread's work asks it to stop.
  static bool requested();

 private:
  using Clock = std::chrono::steady_clock;
  bool asks(Clock::time_point now);

  Interrupt* outer_;
  Clock::time_point polled_at_;
  std::function<bool()> requested_;
  bool stopped_ = false;
};

}  // namespace amontons
