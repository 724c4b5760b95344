#pragma once
#include <vector>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

using Method = Solution (*)(const Problem&, const Options&);

// One row of a table of methods that are tried in order.
struct Phase {
  enum class From : unsigned char {
    best,  // the best x so far
    last,  // where the phase before ended, better or not
    start  // the start of the solve: the best x may lie where Coulomb's law has no solution nearby
  };
  Method method;
  const char* why;
  std::size_t iterations = 0;  // limit; 0: the method's own
  From from = From::best;
  bool frozen = false;   // on the convex problem with the De Saxce term of the starting point frozen
  bool follows = false;  // runs only if the row before did
  double aim = 1;        // part of the tolerance that it goes on to
  bool (*when)(const Options&, const Solution& best) = nullptr;  // skipped where the answer is false
};

// Runs the rows in turn until none has anything left to do, each within what is left of the deadline and of
// max_iterations. The solution is the best of all; `method` is that which made it, `phases` and the end of
// `reason` tell all that ran, counts, time and history are those of the whole.
Solution run_phases(const Problem& problem, const Options& options, const std::vector<Phase>& table);

// "apgd (120 iterations, residual 3.1e-05: the reason), newton (4, 2e-9: the reason)"
std::string describe(const std::vector<PhaseRecord>& phases);

}  // namespace amontons
