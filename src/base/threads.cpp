#include "amontons/base/threads.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

#if defined(__unix__) || defined(__APPLE__)
#include <pthread.h>
#include <unistd.h>
#endif
#if defined(__linux__)
#include <sched.h>
#elif defined(_WIN32)
#define WIN32_LEAN_AND_MEAN
#define NOMINMAX
#include <windows.h>

#include <bit>
#endif

// The course of a call. The caller writes the task into fields that all workers read, gives each thread a
// range of the tasks, and publishes the call by increasing its number (release). A worker that sees it
// (acquire) claims the tasks of its own range one by one, then those left of the others'. The caller does the
// same. Every finished task decrements a counter (release), and when the caller reads zero there (acquire) it
// sees all results.
//
// So a thread without a core delays the others only if it stopped in the middle of a task; otherwise they do
// its share. It may even sleep through calls. It then claims nothing from the missed call, or from the next
// one with the data of the last. Reason: a claim is one compare-and-swap of a word with the number of the
// call, the next task and the end of the range. A call ends only when all its ranges are empty, and a task
// from a nonempty range belongs to the call whose fields were read.
//
// Short loops lose their time in waiting: waking a thread that sleeps in the kernel takes some tens of
// microseconds, as long as a whole loop. So a worker first spins, which reacts within a fraction of a
// microsecond. Then it yields, for machines with fewer cores than threads. Then it sleeps, so that an idle
// pool costs nothing.
namespace amontons {

namespace {

// Marks a spinning loop for the processor, which then saves power and leaves the core to its twin.
inline void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

// Spins while `value` equals `old`, then lets other threads run. False if the limit is reached. 4000 pauses
// take ten to two hundred microseconds, depending on the processor: longer than the time between two loops of
// a solve.
template <class T>
bool changed(const std::atomic<T>& value, T old) {
  // Pauses, then yields (counts), before the thread sleeps.
  constexpr int spins = 4000, yields = 64;
  for (int i = 0; i < spins; ++i) {
    if (value.load(std::memory_order_acquire) != old) return true;
    pause();
  }
  for (int i = 0; i < yields; ++i) {
    if (value.load(std::memory_order_acquire) != old) return true;
    std::this_thread::yield();
  }
  return false;
}

// Threads inside a call start no others: see automatic_threads().
thread_local bool inside = false;

// The unclaimed tasks of one thread, in one word.
class alignas(64) Tasks {
 public:
  static constexpr std::size_t most = (std::size_t{1} << 18) - 1;

  void give(std::uint64_t call, std::size_t first, std::size_t last) {
    word_.store(call << 36 | first << 18 | last, std::memory_order_release);
  }
  // Claims the next task of the call, if any is left.
  bool claim(std::uint64_t call, std::size_t& task) {
    std::uint64_t word = word_.load(std::memory_order_acquire);
    for (;;) {
      task = word >> 18 & most;
      if (word >> 36 != call || task >= (word & most)) return false;
      const std::uint64_t next = word + (std::uint64_t{1} << 18);
      if (word_.compare_exchange_weak(word, next, std::memory_order_acq_rel)) return true;
    }
  }

 private:
  std::atomic<std::uint64_t> word_{0};
};

}  // namespace

// `call` is the number of the call, in as many bits as a word of Tasks has for it.
struct ThreadPool::Workers {
  static constexpr std::uint32_t call_mask = (1u << 28) - 1;

  explicit Workers(unsigned count) : ranges(count) {}

  std::vector<std::thread> threads;
  std::vector<Tasks> ranges;  // of the caller, then of each worker
  std::atomic<Range> range{nullptr};
  std::atomic<const void*> body{nullptr};
  std::atomic<bool> quit{false};
  alignas(64) std::atomic<std::uint32_t> call{0};
  alignas(64) std::atomic<std::size_t> left{0};

  // Own tasks first, which keeps their data in one cache, then those of the others.
  void work(std::uint32_t number, std::size_t thread) {
    const Range run = range.load(std::memory_order_relaxed);
    const void* what = body.load(std::memory_order_relaxed);
    inside = true;
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      Tasks& tasks = ranges[(thread + k) % ranges.size()];
      for (std::size_t task; tasks.claim(number & call_mask, task);) {
        run(what, task, task + 1);
        left.fetch_sub(1, std::memory_order_acq_rel);
      }
    }
    inside = false;
  }

  // The main loop of a worker.
  void loop(std::size_t thread) {
    for (std::uint32_t seen = 0;;) {
      while (!changed(call, seen)) call.wait(seen, std::memory_order_acquire);
      seen = call.load(std::memory_order_acquire);
      if (quit.load(std::memory_order_acquire)) return;
      work(seen, thread);
    }
  }

  // Wakes sleeping workers; no system call if all are awake.
  void publish() {
    call.fetch_add(1, std::memory_order_acq_rel);
    call.notify_all();
  }
};

ThreadPool::ThreadPool(unsigned threads) {
  if (threads <= 1) return;
  workers_ = std::make_unique<Workers>(threads);
  workers_->threads.resize(threads - 1);
  for (unsigned t = 1; t < threads; ++t)
    workers_->threads[t - 1] = std::thread([w = workers_.get(), t] { w->loop(t); });
}

ThreadPool::~ThreadPool() {
  if (!workers_) return;
  workers_->quit.store(true, std::memory_order_release);
  workers_->publish();
  for (std::thread& thread : workers_->threads) thread.join();
}

unsigned ThreadPool::threads() const {
  return workers_ ? static_cast<unsigned>(workers_->threads.size()) + 1 : 1;
}

// The caller works too, and then waits for the tasks of others. The lengths of the ranges differ by at most
// one, and are the same for every call with this number of tasks.
void ThreadPool::run_ranges(std::size_t tasks, Range range, const void* body) {
  Workers& w = *workers_;
  const bool outer = inside;
  const std::size_t threads = w.ranges.size();
  w.range.store(range, std::memory_order_relaxed);
  w.body.store(body, std::memory_order_relaxed);
  w.left.store(tasks, std::memory_order_relaxed);
  const std::uint32_t number = w.call.load(std::memory_order_relaxed) + 1;
  for (std::size_t t = 0; t < threads; ++t)
    w.ranges[t].give(number & Workers::call_mask, tasks * t / threads, tasks * (t + 1) / threads);
  w.publish();
  w.work(number, 0);
  std::size_t left;
  while ((left = w.left.load(std::memory_order_acquire)) != 0) changed(w.left, left);
  inside = outer;
}

unsigned usable_cores() {
#if defined(__linux__)
  cpu_set_t set;
  if (sched_getaffinity(0, sizeof set, &set) == 0) return static_cast<unsigned>(std::max(1, CPU_COUNT(&set)));
#elif defined(_WIN32)
  // The size of the processor group of this process, at most 64 cores.
  DWORD_PTR own = 0, all = 0;
  if (GetProcessAffinityMask(GetCurrentProcess(), &own, &all) && own)
    return static_cast<unsigned>(std::popcount(own));
#endif
  return std::max(1u, std::thread::hardware_concurrency());
}

unsigned automatic_threads(unsigned asked, std::size_t pieces) {
  if (pieces <= 1) return 1;
  if (asked == 0) asked = inside ? 1 : usable_cores();
  return static_cast<unsigned>(std::clamp<std::size_t>(pieces, 1, asked));
}

namespace {

// The id of this process; it changes by a fork.
long process() {
#if defined(__unix__) || defined(__APPLE__)
  return static_cast<long>(getpid());
#else
  return 0;
#endif
}

// Idle pools. Threads do not survive a fork: the child discards the pools of its parent without joining them.
struct IdlePools {
  std::mutex mutex;
  std::vector<std::unique_ptr<ThreadPool>> pools;
  long owner = process();

  // On Windows the end of a process ends all other threads before this point. If the library is unloaded
  // earlier, it holds the lock that a thread takes to end: joining would wait for ever.
  ~IdlePools() {
#if defined(_WIN32)
    owner = -1;
#endif
    forget_after_fork();
  }
  void forget_after_fork() {
    if (owner == process()) return;
    for (auto& pool : pools) static_cast<void>(pool.release());
    pools.clear();
    owner = process();
  }
};

// Made at the first lease of several threads. Destroyed at the end of the process, which joins all workers.
IdlePools& idle_pools() {
  static IdlePools pools;
#if defined(__unix__) || defined(__APPLE__)
  // A fork waits for the lock: held by another thread, it would stay locked in the child.
  static const int registered =
      pthread_atfork([] { idle_pools().mutex.lock(); }, [] { idle_pools().mutex.unlock(); },
                     [] { idle_pools().mutex.unlock(); });
  static_cast<void>(registered);
#endif
  return pools;
}

}  // namespace

// Takes an idle pool with this number of threads, or makes one. One thread needs no pool and takes no lock.
PoolLease::PoolLease(unsigned threads) {
  if (threads > 1) {
    IdlePools& idle = idle_pools();
    const std::lock_guard lock(idle.mutex);
    idle.forget_after_fork();
    for (auto& pool : idle.pools)
      if (pool->threads() == threads) {
        pool_ = std::move(pool);
        pool = std::move(idle.pools.back());
        idle.pools.pop_back();
        return;
      }
  }
  pool_ = std::make_unique<ThreadPool>(threads);
}

// Returns the pool to the idle ones; its threads sleep until the next lease or the end of the process.
PoolLease::~PoolLease() {
  if (pool_->threads() <= 1) return;
  IdlePools& idle = idle_pools();
  const std::lock_guard lock(idle.mutex);
  idle.pools.push_back(std::move(pool_));
}

}  // namespace amontons
