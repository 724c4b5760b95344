// Private: methods that race for the solution of one problem, in turns; each keeps its state between turns.
#pragma once
#include <vector>

#include "amontons/solvers/driver/driver.hpp"
#include "solvers/direct/constrained.hpp"

namespace amontons {

// Nominal costs (ns). That of a factorisation is a lower bound, and, if that is competitive, the cost with
// fill from a symbolic analysis.
struct Costs {
  double product = 0, factorization = 0;
  // Null if `factorization` is final.
  double (*analyse)(const Problem&) = nullptr;
};

// A method at the start of a race. It starts from the best x of all.
struct Contender {
  Starter start;
  // Printed after the residual that it reached.
  const char* why;
  // Expected products and factorisations to the tolerance, before there are iterations to judge by.
  double products = 0, factorizations = 0;
  // Whether it waits until the previous contender in the list has ended, and starts from the end of that one.
  bool after_previous = false;
  // Limit of its iterations; 0: that of the method.
  std::size_t limit = 0;
  // Whether its first turn lasts until it ends.
  bool to_the_end = false;
};

// Runs the contenders in turns until one reaches the tolerance, all have stalled or the limits of the caller
// are reached. If the caller set no limit, nominal `work` (ns) limits the race. Costs are nominal, that is
// estimates and no clock readings, so that the same problem takes the same turns everywhere. x is the best of
// all, and `method` the one that made it. `phases` and `reason` list the contenders in the order of their
// starts. Counts, time and history are those of the whole race. `rest`: the problem without its bilateral
// rows, on which methods without factorisations run, or null.
Solution race(const Problem& problem, const Options& options, Budget& budget,
              const std::vector<Contender>& contenders, const Costs& costs, double work,
              ConstrainedProblem* rest = nullptr);

}  // namespace amontons
