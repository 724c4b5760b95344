#include "amontons/base/threads.hpp"

#include <atomic>
#include <mutex>
#include <thread>
#include <vector>

#if defined(__unix__) || defined(__APPLE__)
#include <unistd.h>
#endif

namespace amontons {

namespace {

inline void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

// Spins while `value` equals `old`, then lets other threads run. False if the patience ran out.
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

  std::size_t first_task(std::size_t thread) const { return tasks * thread / (threads.size() + 1); }
  void work(std::size_t thread) const { range(body, first_task(thread), first_task(thread + 1)); }

  void loop(std::size_t thread) {
    for (unsigned seen = 0;;) {
      while (!changed(call, seen)) call.wait(seen, std::memory_order_acquire);
      ++seen;
      if (quit) return;
      work(thread);
      running.fetch_sub(1, std::memory_order_release);
    }
  }

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

IdlePools& idle_pools() {
  static IdlePools pools;
  return pools;
}

}  // namespace

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

PoolLease::~PoolLease() {
  if (pool_->threads() <= 1) return;
  IdlePools& idle = idle_pools();
  const std::lock_guard lock(idle.mutex);
  idle.pools.push_back(std::move(pool_));
}

}  // namespace amontons
