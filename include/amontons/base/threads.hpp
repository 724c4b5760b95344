#pragma once
#include <cstddef>
#include <memory>
#include <type_traits>

namespace amontons {

// Persistent workers for loops that are short (microseconds) and many (thousands per solve).
//
// run(tasks, f) calls f(task) for task = 0 .. tasks - 1, the calling thread being one of the workers, and
// returns when all calls have returned. The tasks are split into one contiguous range per thread, the same
// range every time, so that a thread finds the data of its tasks in its own cache; whoever is done helps the
// others, so that a thread without a core is not waited for. There is no lock and no allocation in run();
// workers spin for some microseconds between two calls, then yield, then sleep. Results
// that must not depend on the number of threads follow when every task writes only its own output.
//
// f must not throw and must not call run() of the same pool. One thread at a time may call run().
class ThreadPool {
 public:
  explicit ThreadPool(unsigned threads);  // 0 counts as 1, for which no thread is started
  ~ThreadPool();

  unsigned threads() const;

  // At most 262143 tasks.
  template <class F>
  void run(std::size_t tasks, F&& f) {
    using Task = std::remove_reference_t<F>;
    if (!workers_) {
      for (std::size_t task = 0; task < tasks; ++task) f(task);
      return;
    }
    const auto range = [](const void* body, std::size_t first, std::size_t last) {
      for (std::size_t task = first; task < last; ++task)
        (*static_cast<Task*>(const_cast<void*>(body)))(task);
    };
    run_ranges(tasks, range, &f);
  }

 private:
  using Range = void (*)(const void* body, std::size_t first, std::size_t last);
  void run_ranges(std::size_t tasks, Range range, const void* body);

  struct Workers;
  std::unique_ptr<Workers> workers_;  // empty for one thread
};

// The cores that this process may use, at least 1.
unsigned usable_cores();
// How many threads serve so many pieces of work: as many as were asked for; 0 asks for one per core, but for
// one on a thread that is a worker itself, such as those that advance many worlds side by side.
unsigned automatic_threads(unsigned asked, std::size_t pieces);

// A pool borrowed from the process for as long as the lease lives, so that solves of a few microseconds do
// not start threads. Leases of several threads at a time get pools of their own.
class PoolLease {
 public:
  explicit PoolLease(unsigned threads);
  ~PoolLease();
  PoolLease(const PoolLease&) = delete;
  PoolLease& operator=(const PoolLease&) = delete;

  ThreadPool* operator->() const { return pool_.get(); }
  ThreadPool& operator*() const { return *pool_; }

 private:
  std::unique_ptr<ThreadPool> pool_;
};

}  // namespace amontons
