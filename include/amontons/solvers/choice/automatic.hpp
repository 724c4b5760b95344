#pragma once
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "auto": the direct way eliminates bilateral rows and solves small islands; otherwise methods run in a
// fixed order, island by island. Solution::reason lists what ran. Without a deadline no decision reads the
// clock: the same x every time.
Solution automatic(const Problem&, const Options&, Budget&);
// The same with memory that is kept from one solve to the next; `memory` is a solution whose arrays are used
// again. The result is that of solve_directly() where that applies, else that of solve_iteratively().
Solution automatic(const Problem&, const Options&, Budget&, Elimination&, Solution memory = {});
// Eliminates bilateral rows and solves islands of few rows to rounding. Other methods solve what remains.
// Returns false where the direct way does not apply; `s` is then undefined, but its arrays keep their memory.
bool solve_directly(const Problem&, const Options&, Budget&, Elimination&, Solution& s);
// "interior-point": the central path, then newton and p-spg-fb for the last digits. The most accurate method,
// and the method for hyperstatic stacks. InputError for a function.
Solution interior_point(const Problem&, const Options&, Budget&);
// Methods in a fixed order, island by island. On a device that serves the problem one of its two methods runs
// instead.
Solution solve_iteratively(const Problem&, const Options&, Budget&);

}  // namespace amontons
