#pragma once
#include <functional>
#include <vector>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// A solver of the caller's: x of a problem, (m,), from Options::x0 where that is not empty. It is called by
// the thread that makes the step. Its x is judged by our residual. InputError for x of another length; x that
// is not finite counts as none. What it throws ends the step, with the state put back.
using StepMethod = std::function<std::vector<double>(const Problem&, const Options&)>;

}  // namespace amontons
