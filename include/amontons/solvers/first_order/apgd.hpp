#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution apgd(const Problem&, const Options&);  // "apgd"

}  // namespace amontons
