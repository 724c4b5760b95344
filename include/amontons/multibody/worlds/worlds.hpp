#pragma once
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/step/simulation.hpp"

// Many simulations of one model side by side: what learning and sampling-based control ask for.
namespace amontons {

using Worlds = std::span<const std::shared_ptr<Simulation>>;

// What all worlds are to do: `records` times, take a row of controls, advance `repeat` steps, and note where
// they are.
struct Schedule {
  std::size_t records = 1, repeat = 1;
  // (worlds, records, entries of State::controls) by rows; empty: controls stay as they are.
  std::span<const double> controls;
  unsigned threads = 1;
  // (worlds, records, nv), State::joint_forces; empty: they stay as they are.
  std::span<const double> joint_forces{};
};

// What they did, a row per world and record.
struct Course {
  std::vector<double> q, qd;          // (worlds, records, nq) and (worlds, records, nv)
  std::vector<double> residuals;      // (worlds, records): the largest of the steps
  std::vector<std::uint64_t> missed;  // (worlds, records): steps that did not converge
  std::vector<std::size_t> done;      // per world: records that were completed
  std::vector<std::string> failures;  // per world: why it stopped before the end, empty if it did not
  bool interrupted = false;
};

// Each world is advanced by one thread at a time and nothing is shared but the model, so that its bits are
// those of a run by itself, whatever `threads` is. Rows after a failure are NaN. `interrupted` is asked by
// the calling thread a few times per second; when it says yes, all worlds stop at their next step. Throws
// InputError if a world is there twice or is of another model than the tree.
Course run_worlds(const Tree& tree, Worlds worlds, const Schedule& schedule,
                  const std::function<bool()>& interrupted);

}  // namespace amontons
