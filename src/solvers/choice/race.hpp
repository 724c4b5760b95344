// Private: methods that race for the solution of one problem, in turns; each keeps its state between turns.
#pragma once
#include <vector>

#include "amontons/solvers/driver/driver.hpp"
#include "solvers/direct/constrained.hpp"

namespace amontons {

// Nominal cost of a factorisation (ns): a lower bound, and, if that is competitive, the cost with fill from a
// symbolic analysis.
struct FactorCost {
  double nominal = 0;
  // Null if `nominal` is final.
  double (*analyse)(const Problem&) = nullptr;
};

// A method at the start of a race, with its expected cost before it has run.
struct Contender {
  enum class From : unsigned char {
    // The best x of all when it starts.
    best,
    // The start of the solve, because near the best x Coulomb's law may have no solution.
    start,
    // The end of the previous contender in the list; this one waits until that has ended.
    previous
  };
  Starter start;
  // Printed after the residual that it reached.
  const char* why;
  // Nominal cost of a product, or of what the method counts as one (ns).
  double product = 0;
  // Products and factorisations to the tolerance, before there are iterations to judge by.
  double products = 0, factorizations = 0;
  // Iterations of its first turn, about what it takes to show a rate.
  std::size_t first_turn = 1;
  From from = From::best;
  // Limit of its iterations; 0: that of the method.
  std::size_t limit = 0;
  // Whether it runs on what bilateral rows leave, where the race has it.
  bool constrained = false;
};

// Runs the contenders in turns until one reaches the tolerance, all have stalled or the limits of the caller
// are reached. If the caller set no limit, nominal `work` (ns) limits the race. Costs are nominal, that is
// estimates and no clock readings, so that the same problem takes the same turns everywhere. x is the best of
// all, and `method` the one that made it. `phases` and `reason` list the contenders in the order of their
// starts. Counts, time and history are those of the whole race. `rest`: the problem without its bilateral
// rows, or null.
Solution race(const Problem& problem, const Options& options, Budget& budget,
              const std::vector<Contender>& contenders, FactorCost factor, double work,
              ConstrainedProblem* rest = nullptr);

}  // namespace amontons
