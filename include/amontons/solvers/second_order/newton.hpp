#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// "newton": semismooth Newton on the natural map, with bursts of p-spg-fb where its steps fail. Near a
// solution it takes a few steps; far away it is as slow as its bursts. InputError for a function.
Solution newton(const Problem&, const Options&, Budget&);
std::unique_ptr<Run> start_newton(const Problem&, const Options&, Budget&);

}  // namespace amontons
