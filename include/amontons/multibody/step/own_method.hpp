#pragma once
#include <functional>
#include <vector>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// A solver of the caller: x of a problem, (m,), from Options::x0 if that is not empty. The thread that makes
// the step calls it. The library measures the residual of its x. InputError for x of another length; x that
// is not finite counts as none. An exception ends the step, with the state put back.
using StepMethod = std::function<std::vector<double>(const Problem&, const Options&)>;

}  // namespace amontons
