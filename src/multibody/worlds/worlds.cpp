#include "amontons/multibody/worlds/worlds.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <thread>

#include "amontons/base/error.hpp"
#include "amontons/base/interrupt.hpp"
#include "amontons/base/threads.hpp"
#include "amontons/multibody/kinematics/motion.hpp"

namespace amontons {

namespace {

// Calls `interrupted` at intervals, on the thread of the caller; every thread sees the answer.
class StopSign {
 public:
  explicit StopSign(const std::function<bool()>& interrupted) : interrupted_(interrupted) {}

  bool asks() const { return std::this_thread::get_id() == caller_ && interrupted_; }
  bool stopped() {
    using namespace std::chrono_literals;
    if (asks()) {
      const auto now = std::chrono::steady_clock::now();
      if (now - asked_ > 20ms) {
        asked_ = now;  // in Python a call takes the global lock
        if (interrupted_()) stop_.store(true, std::memory_order_relaxed);
      }
    }
    return stop_.load(std::memory_order_relaxed);
  }

 private:
  const std::function<bool()>& interrupted_;
  std::thread::id caller_ = std::this_thread::get_id();
  std::chrono::steady_clock::time_point asked_ = std::chrono::steady_clock::now();
  std::atomic<bool> stop_{false};
};

// Number of unfinished worlds, for a thread that waits for them.
class LeftWorlds {
 public:
  explicit LeftWorlds(std::size_t count) : left_(count) {}

  void remove_one() {
    const std::lock_guard lock(mutex_);
    if (--left_ == 0) none_.notify_all();
  }
  // Waits until no world is left or the caller wants to stop; asks some fifty times per second.
  void wait(StopSign& sign) {
    using namespace std::chrono_literals;
    std::unique_lock lock(mutex_);
    while (left_ > 0 && !sign.stopped()) none_.wait_for(lock, 20ms);
  }

 private:
  std::mutex mutex_;
  std::condition_variable none_;
  std::size_t left_;
};

const Tree& tree_of(WorldTrees trees, std::size_t world) { return *trees[trees.size() == 1 ? 0 : world]; }

// Rows of all worlds have the widths of the first tree. Masses, friction or gains may differ: nothing else of
// a world is in a row.
void check_trees(WorldTrees trees, Worlds worlds) {
  AMONTONS_REQUIRE(trees.size() == 1 || trees.size() == worlds.size(),
                   "there must be one tree, or one per world");
  const Tree& first = *trees[0];
  for (const Tree* tree : trees)
    AMONTONS_REQUIRE(tree->nq() == first.nq() && tree->nv() == first.nv() &&
                         tree->model().controls().size() == first.model().controls().size(),
                     "the models must have the same nq, nv and number of controls");
}

// One simulation in two rows would be advanced by two threads. After sorting by address, equals are adjacent.
void check(WorldTrees trees, Worlds worlds, const Schedule& schedule) {
  check_trees(trees, worlds);
  const Tree& tree = *trees[0];
  std::vector<const Simulation*> sorted;
  for (std::size_t k = 0; k < worlds.size(); ++k) {
    AMONTONS_REQUIRE(&worlds[k]->model() == &tree_of(trees, k).model(),
                     "the worlds must be simulations of one model, or each of that of its tree");
    sorted.push_back(worlds[k].get());
  }
  std::sort(sorted.begin(), sorted.end(), std::less<>());
  AMONTONS_REQUIRE(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end(),
                   "a world is there twice; give a copy of it");
  const std::size_t rows = worlds.size() * schedule.records;
  AMONTONS_REQUIRE(
      schedule.controls.empty() || schedule.controls.size() == rows * tree.model().controls().size(),
      "controls must have one row per world and record");
  AMONTONS_REQUIRE(schedule.joint_forces.empty() || schedule.joint_forces.size() == rows * tree.nv(),
                   "joint_forces must have one row per world and record");
}

// Makes `repeat` steps with one row of controls and stores the result in the entry `at`; throws if a step
// fails.
void advance(Simulation& world, std::size_t repeat, StopSign& sign, Course& course, std::size_t at) {
  double residual = 0;
  for (std::size_t k = 0; k < repeat && !sign.stopped(); ++k) {
    const Report report = world.step();
    if (report.status == Status::interrupted && !report.advanced) return;
    AMONTONS_REQUIRE(report.advanced,
                     "the velocities came out not finite at t = " + std::to_string(report.time) + " s");
    residual = std::max(residual, report.residual);
    course.missed[at] += report.status != Status::converged || !report.balanced;
  }
  course.residuals[at] = residual;
}

// Takes a row of the schedule, if it has any.
void take_row(std::span<const double> rows, std::size_t row, std::vector<double>& values) {
  if (!rows.empty()) std::copy_n(rows.data() + row * values.size(), values.size(), values.data());
}

// Runs one world and fills its rows. Its exceptions are stored in its row, and the others continue.
void run(const Tree& tree, Simulation& world, std::size_t row, const Schedule& schedule, StopSign& sign,
         Course& course) {
  const std::size_t first = row * schedule.records;
  std::size_t& done = course.done[row];
  try {
    for (; done < schedule.records; ++done) {
      const std::size_t at = first + done;
      take_row(schedule.controls, at, world.state().controls);
      take_row(schedule.joint_forces, at, world.state().joint_forces);
      advance(world, schedule.repeat, sign, course, at);
      if (sign.stopped()) return;
      const Coordinates c = read_coordinates(tree, world.state());
      std::copy(c.q.begin(), c.q.end(), course.q.begin() + static_cast<std::ptrdiff_t>(at * tree.nq()));
      std::copy(c.qd.begin(), c.qd.end(), course.qd.begin() + static_cast<std::ptrdiff_t>(at * tree.nv()));
    }
  } catch (const std::exception& error) {
    course.failures[row] = error.what();
  }
}

}  // namespace

Course run_worlds(WorldTrees trees, Worlds worlds, const Schedule& schedule,
                  const std::function<bool()>& interrupted) {
  check(trees, worlds, schedule);
  const Tree& tree = *trees[0];
  // Unreached records must not look like results.
  constexpr double unreached = std::numeric_limits<double>::quiet_NaN();
  const std::size_t rows = worlds.size() * schedule.records;
  Course course;
  course.q.assign(rows * tree.nq(), unreached);
  course.qd.assign(rows * tree.nv(), unreached);
  course.residuals.assign(rows, unreached);
  course.missed.assign(rows, 0);
  course.done.assign(worlds.size(), 0);
  course.failures.resize(worlds.size());
  // Steps of different worlds differ in cost, so a free thread takes the next world.
  const auto threads = static_cast<unsigned>(std::clamp<std::size_t>(worlds.size(), 1, schedule.threads));
  std::atomic<std::size_t> next{0};
  LeftWorlds left(worlds.size());
  StopSign sign(interrupted);
  PoolLease pool(threads);
  pool->run(threads, [&](std::size_t) {
    const Interrupt interrupt([&] { return sign.stopped(); });
    for (std::size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < worlds.size();) {
      run(tree_of(trees, i), *worlds[i], i, schedule, sign, course);
      left.remove_one();
    }
    // The caller continues to ask while others finish their worlds. It waits for worlds, not for threads: a
    // thread that has not been scheduled yet holds none.
    if (sign.asks()) left.wait(sign);
  });
  course.interrupted = sign.stopped();
  return course;
}

Course run_worlds(const Tree& tree, Worlds worlds, const Schedule& schedule,
                  const std::function<bool()>& interrupted) {
  const Tree* one = &tree;
  return run_worlds(WorldTrees(&one, 1), worlds, schedule, interrupted);
}

}  // namespace amontons
