#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/step/simulation.hpp"

// Many simulations side by side, for learning and sampling-based control.
namespace amontons {

using Worlds = std::span<const std::shared_ptr<Simulation>>;
// The tree of all worlds, or one per world: models may differ in numbers, not in nq, nv and controls.
using WorldTrees = std::span<const Tree* const>;

// Task of all worlds: `records` times, take a row of controls, advance `repeat` steps, and record the motion.
struct Schedule {
  std::size_t records = 1, repeat = 1;
  // (worlds, records, entries of State::controls) by rows; empty: controls stay constant.
  std::span<const double> controls{};
  unsigned threads = 1;
  // (worlds, records, nv), State::joint_forces; empty: they stay constant.
  std::span<const double> joint_forces{};
};

// Results, one row per world and record.
struct Course {
  std::vector<double> q, qd;          // (worlds, records, nq) and (worlds, records, nv)
  std::vector<double> residuals;      // (worlds, records): the largest of the steps
  std::vector<std::uint64_t> missed;  // (worlds, records): steps that did not converge
  std::vector<std::size_t> done;      // per world: records that were completed
  std::vector<std::string> failures;  // per world: why it stopped before the end; empty if it did not stop
  bool interrupted = false;
};

// Each world is advanced by one thread at a time, and worlds share only the model. Their bits are therefore
// those of a separate run, for any `threads`. Rows after a failure are NaN. The calling thread calls
// `interrupted` a few times per second; if it returns true, all worlds stop at their next step. Throws
// InputError if a world occurs twice, its model is not that of its tree, or the trees differ in structure.
Course run_worlds(WorldTrees trees, Worlds worlds, const Schedule& schedule,
                  const std::function<bool()>& interrupted);
// All worlds of one model.
Course run_worlds(const Tree& tree, Worlds worlds, const Schedule& schedule,
                  const std::function<bool()>& interrupted);

// A change of one entry of a state, of q along qd, or of what acts on it now or in the step before.
struct Change {
  enum class Entry { nothing, q, qd, activation, control, joint_force, held_control, held_joint_force };
  Entry what = Entry::nothing;
  std::size_t index = 0;
  double by = 0;
};

struct ChangedSteps {
  // Per change: the change of the coordinates after the step along qd (nv); qd of the middle of the step
  // (nv); activations of the actuators that have one; qd (nv).
  std::vector<double> rows;
  double residual = 0;  // the largest of all steps
  std::string failure;  // of the first step that failed, empty without one
  bool interrupted = false;
};

// The state after a step of `before`, for each change of it alone. Bodies are where the tree of joints puts
// them, loops are closed. q: the coordinates from which those after the steps are counted. `steady`: the step
// is one of a motion that lasts (Simulation::begin_with_shown).
ChangedSteps make_changed_steps(const Simulation& before, std::span<const Change> changes,
                                std::span<const double> q, bool steady, unsigned threads,
                                const std::function<bool()>& interrupted);

}  // namespace amontons
