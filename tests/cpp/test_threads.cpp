#include <chrono>
#include <numeric>
#include <thread>
#include <vector>

#include "amontons/base/threads.hpp"
#include "check.hpp"

using namespace amontons;

// Breaks when a task is lost, or taken by two workers: at none, fewer and more tasks than threads, over many
// calls of one pool.
TEST(every_task_runs_once_per_call) {
  for (unsigned threads : {0u, 1u, 2u, 5u}) {
    ThreadPool pool(threads);
    CHECK(pool.threads() == (threads ? threads : 1));
    for (std::size_t tasks : {std::size_t{0}, std::size_t{1}, std::size_t{3}, std::size_t{100}}) {
      std::vector<int> count(tasks);
      for (int call = 0; call < 200; ++call) pool.run(tasks, [&](std::size_t task) { ++count[task]; });
      for (int c : count) CHECK(c == 200);
    }
  }
}

// Breaks when a worker that went to sleep misses the next call.
TEST(workers_wake_up) {
  ThreadPool pool(3);
  std::vector<int> count(6);
  for (int call = 0; call < 5; ++call) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    pool.run(count.size(), [&](std::size_t task) { ++count[task]; });
  }
  CHECK(std::accumulate(count.begin(), count.end(), 0) == 30);
}

// Breaks when workers take what is left instead of their own tasks: memory that a task touched first would
// then lie with another core.
TEST(tasks_have_the_same_thread_every_time) {
  ThreadPool pool(2);
  std::vector<std::thread::id> first(7), again(7);
  pool.run(first.size(), [&](std::size_t task) { first[task] = std::this_thread::get_id(); });
  pool.run(again.size(), [&](std::size_t task) { again[task] = std::this_thread::get_id(); });
  CHECK(first == again);
}

// Breaks when a lease starts new threads although a pool of that size is idle, or when two leases share one.
TEST(leases_reuse_idle_pools) {
  std::vector<std::thread::id> first(4), again(4), other(4);
  const auto run = [](const PoolLease& pool, std::vector<std::thread::id>& ids) {
    pool->run(ids.size(), [&](std::size_t task) { ids[task] = std::this_thread::get_id(); });
  };
  {
    const PoolLease pool(2);
    run(pool, first);
  }
  const PoolLease pool(2), second(2);
  run(pool, again), run(second, other);
  CHECK(first == again);
  CHECK(other.front() == again.front() && other.back() != again.back());
}
