// Private: elimination as a contender of a race.
#pragma once
#include <memory>

#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// What elimination is expected to take (ns); infinite where its islands are too large or the options ask for
// the records of iterations, which it has none of.
double elimination_cost(const Problem&, const Options&);

// Elimination as a run of one turn. Where it does not apply after all it ends without a factorisation, at
// zero.
std::unique_ptr<Run> start_elimination(const Problem&, const Options&);

}  // namespace amontons
