#pragma once
#include "amontons/base/budget.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "p-spg-fb-literal": the algorithm of the paper, unchanged, to reproduce its figures. For other uses take
// spg().
Solution spg_literal(const Problem&, const Options&, Budget&);

}  // namespace amontons
