#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution spg_literal(const Problem&, const Options&);  // "p-spg-fb-literal"

}  // namespace amontons
