#pragma once
#include <cstddef>
#include <memory>
#include <type_traits>

namespace amontons {

// Persistent workers for loops that are short (microseconds) and many (thousands per solve).
//
// run(tasks, f) calls f(task) for task = 0 .. tasks - 1 and returns when all calls have returned; the calling
// thread is one of the workers. Every thread has one contiguous range of tasks, the same in every run, so
// that its data stay in its own cache. A thread that is done helps the others, so a thread without a core
// delays nothing. run() takes no lock and allocates nothing. Workers spin for some microseconds between two
// calls, then yield, then sleep. Results do not depend on the number of threads if every task writes only its
// own output.
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
// Number of threads for `pieces` pieces of work: `asked` if positive. 0 means one per core, but one thread on
// a worker, such as those that advance many worlds side by side.
unsigned automatic_threads(unsigned asked, std::size_t pieces);

// A pool borrowed from the process during the lifetime of the lease, so that solves of a few microseconds do
// not start threads. Simultaneous leases of several threads get separate pools.
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
