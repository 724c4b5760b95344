#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution admm(const Problem&, const Options&);  // "admm"

}  // namespace amontons
