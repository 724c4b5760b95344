#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// "apgd": accelerated projected gradients (Nesterov) with adaptive step and restart. Products only, no
// factorisation; any operator and any set.
Solution apgd(const Problem&, const Options&, Budget&);  // "apgd"
std::unique_ptr<Run> start_apgd(const Problem&, const Options&, Budget&);

}  // namespace amontons
