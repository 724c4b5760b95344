#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution jacobi(const Problem&, const Options&);  // "jacobi"

}  // namespace amontons
