#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution newton(const Problem&, const Options&);  // "newton"

}  // namespace amontons
