// Private: the interior point under coulomb, with the De Saxce term of its start held constant.
#pragma once
#include <memory>

#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// Rounds of a central path on the convex problem of the best x so far and a burst of apgd that renews the
// term. For friction under coulomb; A must be factorable.
std::unique_ptr<Run> start_frozen_path(const Problem&, const Options&, Budget&);

}  // namespace amontons
