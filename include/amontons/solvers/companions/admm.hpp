#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// "admm": alternating direction method of multipliers; one factorisation serves many iterations. Most conic
// solvers and several contact solvers use it. Good on joints and small stacks at rest. InputError for a
// function.
Solution admm(const Problem&, const Options&, Budget&);
std::unique_ptr<Run> start_admm(const Problem&, const Options&, Budget&);

}  // namespace amontons
