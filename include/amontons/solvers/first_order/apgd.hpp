#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "apgd": accelerated projected gradients (Nesterov) with adaptive step and restart. Products only, no
// factorisation; any operator and any set.
Solution apgd(const Problem&, const Options&);  // "apgd"

}  // namespace amontons
