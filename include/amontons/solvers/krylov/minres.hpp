#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution minres(const Problem&, const Options&);  // "minres", K = R^m only

}  // namespace amontons
