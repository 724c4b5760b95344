#pragma once
#include <string_view>
#include <vector>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

using Method = Solution (*)(const Problem&, const Options&);

// One method of a sequence. iterations: its limit, 0 for its own default. afresh: from the start of the
// sequence instead of the best x so far, which may lie where Coulomb's law has no solution nearby. when:
// asked with the best solution so far; the phase is skipped where the answer is false.
struct Phase {
  Method method;
  std::size_t iterations = 0;
  bool afresh = false;
  bool (*when)(const Problem&, const Options&, const Solution& best) = nullptr;
};

// Runs the phases one after the other until one converges, each from the best x so far and within what is
// left of the deadline and of max_iterations. The solution is the best of all; its counts, time and history
// are those of the whole sequence, its method the one that produced x.
Solution run_phases(const Problem& problem, const Options& options, const std::vector<Phase>& phases);

}  // namespace amontons
