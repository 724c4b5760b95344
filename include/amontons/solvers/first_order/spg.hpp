#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// "p-spg-fb": preconditioned spectral projected gradients with fallback to the best iterate (Tasora 2013).
// One product per iteration, no factorisation, any operator and any set; SpgOptions are its parameters.
Solution spg(const Problem&, const Options&, Budget&);  // "p-spg-fb"
std::unique_ptr<Run> start_spg(const Problem&, const Options&, Budget&);

}  // namespace amontons
