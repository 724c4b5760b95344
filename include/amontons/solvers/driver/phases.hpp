#pragma once
#include <vector>

#include "amontons/base/budget.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// A method with the limits of time and work that its caller shares with it.
using Method = Solution (*)(const Problem&, const Options&, Budget&);

// A solve with several methods is a table of these rows, tried in order. The same data says what runs, what
// Solution::reason prints and what Solution::phases lists. Each row starts from the best x so far. For
// methods that take turns see choice/race.
struct Phase {
  Method method;
  // Printed after the residual that the row reached.
  const char* why;
  // Limit of this row; 0: the method's own.
  std::size_t iterations = 0;
};

// Runs the rows in turn until one ends the solve or no row is left, each within the rest of the budget and
// of max_iterations. x is the best of all rows, and `method` the one that made it. `phases` and `reason` list
// all that ran. Counts, time and history are sums over the rows.
Solution run_phases(const Problem& problem, const Options& options, Budget& budget,
                    const std::vector<Phase>& table);

// Adds the cost of another part: iterations, products, factorisations. The caller measures the time.
void add_counts(Solution& total, const Solution& part);

// Takes x, its method and its measures from `other` if that has a smaller residual or `s` has no x yet.
// Returns whether it did. Counts, time, status, phases and reason stay.
bool take_better(Solution& s, Solution&& other);

// "apgd (120 iterations, residual 3.1e-05: the reason), newton (4 iterations, residual 2.0e-09: the reason)"
std::string describe(const std::vector<PhaseRecord>& phases);

}  // namespace amontons
