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

// How a call runs. The caller writes what is to be done into fields that all workers read, gives each thread
// a range of the tasks, and publishes the call by raising its number (release). A worker that sees it
// (acquire) claims the tasks of its own range one by one, then those that are left of the others', and so
// does the caller; every finished task lowers a counter (release), and when the caller reads zero there
// (acquire) it sees all that was written.
//
// So a thread that does not get a core is not waited for, unless it stopped in the middle of a task: on a
// machine with more threads than cores the others do its share. It may even sleep through calls. That it then
// takes nothing from the call that it missed, or from the next one with what it read of the last, follows
// from a claim being one compare-and-swap of a word that holds the number of the call, the next task and the
// end of the range: a call ends only when all its ranges are empty, and what is claimed from a range that is
// not yet empty belongs to the call whose fields were read.
//
// Waiting is where short loops lose their time: waking a thread that sleeps in the kernel takes some tens of
// microseconds, as long as a whole loop. So a worker first spins, which reacts within a fraction of a
// microsecond; then yields, so that a machine with fewer cores than threads goes on; then sleeps, so that an
// idle pool costs nothing.
namespace amontons {

namespace {

// Tells the processor that this is a spinning loop, so that it saves power and leaves the core to its twin.
inline void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

// Spins while `value` equals `old`, then lets other threads run. False if the patience ran out. 4000 pauses
// are ten to two hundred microseconds, depending on the processor: longer than the time between two loops of
// a solve.
template <class T>
bool changed(const std::atomic<T>& value, T old) {
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

// Threads inside a call do not start others: see automatic_threads().
thread_local bool inside = false;

// The tasks of one thread that nobody has claimed, in one word.
class alignas(64) Tasks {
 public:
  static constexpr std::size_t most = (std::size_t{1} << 18) - 1;

  void give(std::uint64_t call, std::size_t first, std::size_t last) {
    word_.store(call << 36 | first << 18 | last, std::memory_order_release);
  }
  // The next one of the call, if any is left.
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

// `call` counts the calls, in as many bits as a word of Tasks has for it.
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

  // Own tasks first, which keeps what they touch in one cache, then those of the others.
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

  // The life of a worker.
  void loop(std::size_t thread) {
    for (std::uint32_t seen = 0;;) {
      while (!changed(call, seen)) call.wait(seen, std::memory_order_acquire);
      seen = call.load(std::memory_order_acquire);
      if (quit.load(std::memory_order_acquire)) return;
      work(seen, thread);
    }
  }

  // Wakes those that sleep; no system call if nobody does.
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

// The caller works rather than waits, and then waits for tasks that others are in the middle of. Ranges whose
// lengths differ by one at most, the same for every call of as many tasks.
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
  // Of the processor group of this process, which has 64 cores at most.
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

// The number of this process; a fork changes it.
long process() {
#if defined(__unix__) || defined(__APPLE__)
  return static_cast<long>(getpid());
#else
  return 0;
#endif
}

// Idle pools. Threads do not survive a fork: the child forgets the pools of its parent without joining them.
struct IdlePools {
  std::mutex mutex;
  std::vector<std::unique_ptr<ThreadPool>> pools;
  long owner = process();

  // On Windows the end of a process ends all other threads before it comes here; and where the library is
  // unloaded earlier, it holds the lock that a thread takes to end: joining would wait for ever.
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

// Made at the first lease of several threads, and destroyed at the end of the process, which joins all
// workers.
IdlePools& idle_pools() {
  static IdlePools pools;
#if defined(__unix__) || defined(__APPLE__)
  // A fork waits for the lock: taken by another thread it would stay locked in the child.
  static const int registered =
      pthread_atfork([] { idle_pools().mutex.lock(); }, [] { idle_pools().mutex.unlock(); },
                     [] { idle_pools().mutex.unlock(); });
  static_cast<void>(registered);
#endif
  return pools;
}

}  // namespace

// An idle pool with as many threads, or a new one. One thread needs no pool and takes no lock.
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

// Back to the idle ones, where its threads sleep until the next lease or the end of the process.
PoolLease::~PoolLease() {
  if (pool_->threads() <= 1) return;
  IdlePools& idle = idle_pools();
  const std::lock_guard lock(idle.mutex);
  idle.pools.push_back(std::move(pool_));
}

}  // namespace amontons
