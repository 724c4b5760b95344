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
#include "amontons/multibody/kinematics/closure.hpp"
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

// Calls f(world, thread) for each. Steps of different worlds differ in cost, so a free thread takes the next
// world.
template <class F>
void side_by_side(std::size_t count, std::size_t most_threads, StopSign& sign, const F& f) {
  const auto threads = static_cast<unsigned>(std::clamp<std::size_t>(count, 1, most_threads));
  std::atomic<std::size_t> next{0};
  LeftWorlds left(count);
  PoolLease pool(threads);
  pool->run(threads, [&](std::size_t thread) {
    const Interrupt interrupt([&] { return sign.stopped(); });
    for (std::size_t i; (i = next.fetch_add(1, std::memory_order_relaxed)) < count;) {
      f(i, thread);
      left.remove_one();
    }
    // The caller continues to ask while others finish their worlds. It waits for worlds, not for threads: a
    // thread that has not been scheduled yet holds none.
    if (sign.asks()) left.wait(sign);
  });
}

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
  StopSign sign(interrupted);
  side_by_side(worlds.size(), schedule.threads, sign, [&](std::size_t i, std::size_t) {
    run(tree_of(trees, i), *worlds[i], i, schedule, sign, course);
  });
  course.interrupted = sign.stopped();
  return course;
}

Course run_worlds(const Tree& tree, Worlds worlds, const Schedule& schedule,
                  const std::function<bool()>& interrupted) {
  const Tree* one = &tree;
  return run_worlds(WorldTrees(&one, 1), worlds, schedule, interrupted);
}

namespace {

// Bodies where the tree of joints puts them. In a simulation they are elsewhere by the errors of their
// joints, which no coordinate shows. A difference to a state that is not placed would have these errors.
void place(const Tree& tree, Coordinates c, State& state) {
  close_loops(tree, state, std::vector<unsigned char>(tree.nv()), c.q);
  close_velocities(tree, state, c.q, std::vector<unsigned char>(tree.nv()), c.qd);
  write_poses(tree, c.q, state);
  write_velocities(tree, c.q, c.qd, state);
}

// `at`: the coordinates of the state, which is placed. Changes of q and of qd open loops. These are closed
// again by the least change of all entries. So the state is one that the mechanism has.
void change(const Tree& tree, const Coordinates& at, const Change& one, State& state) {
  using Entry = Change::Entry;
  std::vector<double> rates(tree.nv());
  switch (one.what) {
    case Entry::nothing:
      return;
    case Entry::q:
      rates[one.index] = one.by;
      return place(tree, {moved_along(tree, at.q, rates, 1), at.qd}, state);
    case Entry::qd:
      rates = at.qd;
      rates[one.index] += one.by;
      close_velocities(tree, state, at.q, std::vector<unsigned char>(tree.nv()), rates);
      return write_velocities(tree, at.q, rates, state);
    case Entry::activation:
      state.activations[one.index] += one.by;
      return;
    case Entry::control:
      state.controls[one.index] += one.by;
      return;
    case Entry::joint_force:
      state.joint_forces[one.index] += one.by;
      return;
    case Entry::held_control:
      state.held_controls[one.index] += one.by;
      return;
    case Entry::held_joint_force:
      state.held_joint_forces[one.index] += one.by;
      return;
  }
}

// A row of ChangedSteps: the state of a simulation, which then shows its middle velocities. The next step
// begins with these. A motion depends on them and on q alone, so that derivatives of steps multiply.
void write_row(const Tree& tree, std::span<const double> q, Simulation& world, double* row) {
  const Coordinates end = read_coordinates(tree, world.state());
  row = std::copy_n(change_along(tree, q, end.q).begin(), tree.nv(), row);
  world.show_middle();
  row = std::copy_n(read_rates(tree, world.state(), end.q).begin(), tree.nv(), row);
  const auto& actuators = tree.model().description().actuators;
  for (std::size_t k = 0; k < actuators.size(); ++k)
    if (actuators[k].dynamics != ActivationKind::none) *row++ = world.state().activations[k];
  std::copy_n(end.qd.begin(), tree.nv(), row);
}

}  // namespace

// Each thread makes its steps with one simulation, since the memory of a first step is dear. A step leaves
// there nothing that changes the bits of the next one.
//
// A step that fails ends none of the others. The caller learns of the first failure in the order of the
// changes, whatever the threads do.
//
// Rows are counted from given coordinates. Steps of variants of a model, over whose parameters a caller takes
// differences, are rows of other calls and have this start in common.
ChangedSteps make_changed_steps(const Simulation& before, std::span<const Change> changes,
                                std::span<const double> q, bool steady, unsigned threads,
                                const std::function<bool()>& interrupted) {
  const Tree& tree = before.tree();
  AMONTONS_REQUIRE(q.size() == tree.nq(), "q must have one entry per coordinate");
  Simulation placed(before);
  placed.show_middle();
  place(tree, read_coordinates(tree, placed.state()), placed.state());
  placed.begin_with_shown(steady);
  const Coordinates at = read_coordinates(tree, placed.state());
  const auto& actuators = tree.model().description().actuators;
  const auto active = static_cast<std::size_t>(std::count_if(
      actuators.begin(), actuators.end(), [](const auto& a) { return a.dynamics != ActivationKind::none; }));
  const std::size_t width = 3 * tree.nv() + active;
  ChangedSteps steps;
  steps.rows.assign(changes.size() * width, 0.0);
  std::vector<double> residuals(changes.size());
  std::vector<std::string> failures(changes.size());
  std::vector<std::unique_ptr<Simulation>> worlds(std::max(threads, 1u));
  StopSign sign(interrupted);
  side_by_side(changes.size(), worlds.size(), sign, [&](std::size_t i, std::size_t thread) {
    if (sign.stopped()) return;
    try {
      std::unique_ptr<Simulation>& own = worlds[thread];
      if (!own)
        own = std::make_unique<Simulation>(placed);
      else
        *own = placed;
      change(tree, at, changes[i], own->state());
      own->begin_with_shown(steady);
      const Report report = own->step();
      residuals[i] = report.residual;
      AMONTONS_REQUIRE(report.advanced, "the velocities came out not finite");
      write_row(tree, q, *own, &steps.rows[i * width]);
    } catch (const std::exception& error) {
      failures[i] = error.what();
    }
  });
  steps.interrupted = sign.stopped();
  for (const double residual : residuals) steps.residual = std::max(steps.residual, residual);
  for (std::string& failure : failures)
    if (steps.failure.empty()) steps.failure = std::move(failure);
  return steps;
}

}  // namespace amontons
