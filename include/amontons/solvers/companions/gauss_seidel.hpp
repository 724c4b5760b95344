#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution gauss_seidel(const Problem&, const Options&);  // "gauss-seidel"

}  // namespace amontons
