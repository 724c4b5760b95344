#pragma once
#include <string>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// Solves the VI of a step from the impulses of the last one, options.x0.
Solution solve_step(const Problem& problem, const std::string& method, const Options& options);

}  // namespace amontons
