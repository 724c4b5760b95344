#pragma once
#include "amontons/base/budget.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "jacobi": projected gradients with a fixed step: the simplest and slowest method, kept as a yardstick.
Solution jacobi(const Problem&, const Options&, Budget&);

}  // namespace amontons
