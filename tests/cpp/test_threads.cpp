#include <atomic>
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

// Tasks that wait for each other, one per thread, so that each thread takes its own: who ran which.
std::vector<std::thread::id> owners(ThreadPool& pool) {
  std::vector<std::thread::id> ids(pool.threads());
  std::atomic<std::size_t> begun{0};
  pool.run(ids.size(), [&](std::size_t task) {
    ids[task] = std::this_thread::get_id();
    ++begun;
    while (begun < ids.size()) std::this_thread::yield();
  });
  return ids;
}

// Breaks when workers take what is left instead of their own tasks: memory that a task touched first would
// then lie with another core.
TEST(tasks_have_the_same_thread_every_time) {
  ThreadPool pool(3);
  const std::vector<std::thread::id> first = owners(pool);
  CHECK(first[0] == std::this_thread::get_id());
  for (int call = 0; call < 20; ++call) CHECK(owners(pool) == first);
}

// Breaks when a call waits for the thread whose range a task is in: the first task of the second thread's
// range waits for all the others, which somebody else has to do.
TEST(a_thread_that_is_held_up_is_helped) {
  ThreadPool pool(2);
  for (int call = 0; call < 200; ++call) {
    std::atomic<int> done{0};
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    pool.run(8, [&](std::size_t task) {
      while (task == 4 && done < 7 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
      ++done;
    });
    CHECK(done == 8 && std::chrono::steady_clock::now() < end);
  }
}

// Breaks when a loop that runs inside a task starts a thread per core for itself.
TEST(threads_do_not_multiply) {
  CHECK(automatic_threads(3, 100) == 3 && automatic_threads(3, 2) == 2 && automatic_threads(0, 0) == 1);
  CHECK(automatic_threads(0, 1000) == usable_cores());
  ThreadPool pool(2);
  std::vector<unsigned> inner(2);
  pool.run(2, [&](std::size_t task) { inner[task] = automatic_threads(0, 1000); });
  CHECK(inner[0] == 1 && inner[1] == 1);
  CHECK(automatic_threads(0, 1000) == usable_cores());
}

// Breaks when a lease starts new threads although a pool of that size is idle, or when two leases share one.
TEST(leases_reuse_idle_pools) {
  std::vector<std::thread::id> first;
  {
    const PoolLease pool(2);
    first = owners(*pool);
  }
  const PoolLease pool(2), second(2);
  const std::vector<std::thread::id> again = owners(*pool), other = owners(*second);
  CHECK(first == again);
  CHECK(other.front() == again.front() && other.back() != again.back());
}
