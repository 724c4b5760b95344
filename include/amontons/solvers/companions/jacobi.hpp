#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "jacobi": projected gradients with a fixed step, the simplest method and the slowest: the yardstick.
Solution jacobi(const Problem&, const Options&);

}  // namespace amontons
