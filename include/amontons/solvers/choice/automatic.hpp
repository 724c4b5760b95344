#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

Solution automatic(const Problem&,
                   const Options&);  // "auto": a table of phases by the structure of the problem

}  // namespace amontons
