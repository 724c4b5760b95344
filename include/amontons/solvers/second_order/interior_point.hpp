#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution interior_point(const Problem&, const Options&);  // "interior-point"
// The same without the crossover that takes the last digits.
Solution central_path(const Problem&, const Options&);

}  // namespace amontons
