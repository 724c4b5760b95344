#include "amontons/base/threads.hpp"

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#if defined(__unix__) || defined(__APPLE__)
#include <pthread.h>
#include <unistd.h>
#endif

// How a call runs. The caller writes what is to be done into fields that all workers read, and publishes it
// by raising a counter (release); a worker that sees the counter rise (acquire) sees the fields as well. It
// runs its range and lowers a second counter (release); when the caller reads zero there (acquire), it sees
// all that the workers have written. These two counters, on cache lines of their own, are all that is shared.
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

}  // namespace

// A call is published by raising `call`; the workers answer by lowering `running` to zero. The fields between
// are written only while no worker is running.
struct ThreadPool::Workers {
  std::vector<std::thread> threads;
  Range range = nullptr;
  const void* body = nullptr;
  std::size_t tasks = 0;
  bool quit = false;
  alignas(64) std::atomic<unsigned> call{0};
  alignas(64) std::atomic<unsigned> running{0};

  // Contiguous ranges whose lengths differ by one at most; the same for every call of as many tasks.
  std::size_t first_task(std::size_t thread) const { return tasks * thread / (threads.size() + 1); }
  void work(std::size_t thread) const { range(body, first_task(thread), first_task(thread + 1)); }

  // The life of a worker. Counters may not skip a value: the next call is published only after all workers
  // have answered this one, so each sees every one of them.
  void loop(std::size_t thread) {
    for (unsigned seen = 0;;) {
      while (!changed(call, seen)) call.wait(seen, std::memory_order_acquire);
      ++seen;
      if (quit) return;
      work(thread);
      running.fetch_sub(1, std::memory_order_release);
    }
  }

  // Wakes those that sleep; no system call if nobody does.
  void publish() {
    call.fetch_add(1, std::memory_order_release);
    call.notify_all();
  }
};

ThreadPool::ThreadPool(unsigned threads) {
  if (threads <= 1) return;
  workers_ = std::make_unique<Workers>();
  // Reserved to its final size first: the workers read its size.
  workers_->threads.resize(threads - 1);
  for (unsigned t = 1; t < threads; ++t)
    workers_->threads[t - 1] = std::thread([w = workers_.get(), t] { w->loop(t); });
}

ThreadPool::~ThreadPool() {
  if (!workers_) return;
  workers_->quit = true;
  workers_->publish();
  for (std::thread& thread : workers_->threads) thread.join();
}

unsigned ThreadPool::threads() const {
  return workers_ ? static_cast<unsigned>(workers_->threads.size()) + 1 : 1;
}

// The caller is worker 0: it works rather than waits, and then waits for the slowest of the others.
void ThreadPool::run_ranges(std::size_t tasks, Range range, const void* body) {
  Workers& w = *workers_;
  w.range = range;
  w.body = body;
  w.tasks = tasks;
  w.running.store(static_cast<unsigned>(w.threads.size()), std::memory_order_relaxed);
  w.publish();
  w.work(0);
  unsigned left;
  while ((left = w.running.load(std::memory_order_acquire)) != 0) changed(w.running, left);
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

  ~IdlePools() { forget_after_fork(); }
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
