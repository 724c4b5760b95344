#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution spg(const Problem&, const Options&);  // "p-spg-fb"

}  // namespace amontons
