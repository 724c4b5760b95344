#pragma once
#include <span>

#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/options.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

// Projects a start x0; forms its u and objective by one product.
void begin_at(const Problem& problem, std::span<const double> x0, Solution& s, unsigned threads = 1);
// The same for the start of the options, with its residual.
void measure_start(const Problem& problem, const Options& options, Solution& s);
// A start that meets the tolerance, as the solution of `method`.
Solution accepted(Solution start, const char* method);

}  // namespace amontons
