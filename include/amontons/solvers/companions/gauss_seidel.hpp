#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// "gauss-seidel": each cone in turn with the newest impulses, as in engines for games. Good to few digits on
// small stacks; slow on high stacks and mass ratios. InputError for a function, which has no rows.
Solution gauss_seidel(const Problem&, const Options&, Budget&);

}  // namespace amontons
