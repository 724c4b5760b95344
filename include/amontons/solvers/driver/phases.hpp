#pragma once
#include <vector>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

using Method = Solution (*)(const Problem&, const Options&);

// A solve with several methods is a table of these rows, tried in order: what runs, what is printed of it in
// Solution::reason and what Solution::phases lists are one and the same data. Each starts from the best x so
// far. (For methods that take turns see choice/race.)
struct Phase {
  Method method;
  // Printed after the residual that the row reached.
  const char* why;
  // Limit of this row; 0: the method's own.
  std::size_t iterations = 0;
};

// Runs the rows in turn until none has anything left to do, each within what is left of the deadline and of
// max_iterations. x is the best of all and `method` that which made it, `phases` and `reason` tell all that
// ran, counts, time and history are those of the whole.
Solution run_phases(const Problem& problem, const Options& options, const std::vector<Phase>& table);

// Adds what a further part cost: iterations, products, factorisations. The time is for who measures it.
void add_counts(Solution& total, const Solution& part);

// Takes x and what belongs to it, the method that made it included, where the other has a smaller residual or
// there is no x yet; returns whether it did. Counts, time, status, phases and reason stay.
bool take_better(Solution& s, Solution&& other);

// "apgd (120 iterations, residual 3.1e-05: the reason), newton (4 iterations, residual 2.0e-09: the reason)"
std::string describe(const std::vector<PhaseRecord>& phases);

}  // namespace amontons
