// Private: methods in a fixed order for the solution of one problem; each keeps its state while others run.
#pragma once
#include <vector>

#include "amontons/solvers/driver/driver.hpp"
#include "solvers/direct/constrained.hpp"

namespace amontons {

// A method of an order. It starts from the best x of all.
struct Ordered {
  Starter start;
  // Printed after the residual that it reached.
  const char* why;
  // Limit of its iterations; 0: that of the method.
  std::size_t limit = 0;
  // Expected factorisations to the tolerance. A method that has none gives way to the next that has, once its
  // rate promises the tolerance only for more work. It goes on when all others have ended.
  double factorizations = 0;
  // Whether it starts from the end of the previous method instead.
  bool from_the_end = false;
};

// Runs the methods, each to its end or until it gives way, until one reaches the tolerance, all have ended or
// the limits of the caller are reached. Work is that of Budget, which is counted, so that the same problem
// takes the same turns everywhere. x is the best of all, and `method` the one that made it. `phases` and
// `reason` list the methods in the order of their starts. Counts, time and history are those of all. `rest`:
// the problem without its bilateral rows, on which methods without factorisations run, or null.
Solution in_order(const Problem& problem, const Options& options, Budget& budget,
                  const std::vector<Ordered>& methods, ConstrainedProblem* rest = nullptr);

}  // namespace amontons
