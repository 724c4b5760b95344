#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "p-spg-fb-literal": the algorithm of the paper to the letter, to reproduce its figures; spg() is the form
// for use.
Solution spg_literal(const Problem&, const Options&);

}  // namespace amontons
