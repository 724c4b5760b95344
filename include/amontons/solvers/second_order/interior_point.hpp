#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// The central path alone, without the crossover of "interior-point" (choice/automatic.hpp): one factorisation
// per step, ten to thirty steps. InputError for a function.
std::unique_ptr<Run> start_central_path(const Problem&, const Options&, Budget&);

}  // namespace amontons
