#pragma once
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "auto": bilateral rows are eliminated where that leaves little; else methods race, island by island.
// Solution::reason tells what ran. Without a deadline the clock decides nothing: the same x every time.
Solution automatic(const Problem&, const Options&);
// The same with memory that is kept from one solve to the next; a solution that is no longer needed lends its
// arrays. It is solve_directly() where that applies, else solve_by_race().
Solution automatic(const Problem&, const Options&, Elimination&, Solution memory = {});
// Eliminates bilateral rows and solves islands of few rows to rounding. What stays unsolved goes
// to the race. False where the direct way does not apply; `s`, whose arrays keep their memory, is then
// undefined.
bool solve_directly(const Problem&, const Options&, Elimination&, Solution& s);
// Methods race, island by island; on a device that serves the problem one of its two methods runs.
Solution solve_by_race(const Problem&, const Options&);

}  // namespace amontons
