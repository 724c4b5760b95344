#pragma once
#include "amontons/solvers/driver/options.hpp"
#include "amontons/solvers/elimination/elimination.hpp"

namespace amontons {

// "auto": bilateral rows are eliminated where that leaves little; else methods race, island by island.
// Solution::reason tells what ran. Without a deadline the clock decides nothing: the same x every time.
Solution automatic(const Problem&, const Options&);
// The same with memory that is kept from one solve to the next; a solution that is no longer needed lends its
// arrays.
Solution automatic(const Problem&, const Options&, Elimination&, Solution memory = {});

}  // namespace amontons
