#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// The central path of Coulomb's law, followed as a curve (central_path/central_curve.hpp), for many rows. It
// is the first phase of "interior-point" under coulomb.
std::unique_ptr<Run> start_coulomb_path(const Problem&, const Options&, Budget&);

}  // namespace amontons
