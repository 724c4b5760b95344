#pragma once
#include <vector>

#include "amontons/base/budget.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// A method with the limits of time and work that its caller shares with it.
using Method = Solution (*)(const Problem&, const Options&, Budget&);

// Adds the cost of another part: iterations, products, factorisations. The caller measures the time.
void add_counts(Solution& total, const Solution& part);

// Adds another solve of the same problem: its counts, time and phases. x, its method and its measures are
// those of the smaller residual. Status and reason stay.
void join(Solution& total, Solution part);

// "apgd (120 iterations, residual 3.1e-05: the reason), newton (4 iterations, residual 2.0e-09: the reason)"
std::string describe(const std::vector<PhaseRecord>& phases);

}  // namespace amontons
