#pragma once
#include <vector>

#include "amontons/base/budget.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// A method with the limits of time and work that its caller shares with it.
using Method = Solution (*)(const Problem&, const Options&, Budget&);

// Adds the cost of another part: iterations, products, factorisations. The caller measures the time.
void add_counts(Solution& total, const Solution& part);

// Takes x, its method and its measures from `other` if that has a smaller residual or `s` has no x yet.
// Returns whether it did. Counts, time, status, phases and reason stay.
bool take_better(Solution& s, Solution&& other);

// "apgd (120 iterations, residual 3.1e-05: the reason), newton (4 iterations, residual 2.0e-09: the reason)"
std::string describe(const std::vector<PhaseRecord>& phases);

}  // namespace amontons
