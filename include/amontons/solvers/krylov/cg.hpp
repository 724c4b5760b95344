#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution cg(const Problem&, const Options&);  // "cg", K = R^m only
// The same, preconditioned by one factorisation.
Solution factored_cg(const Problem&, const Options&);

}  // namespace amontons
