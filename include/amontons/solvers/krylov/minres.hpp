#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "minres": minimal residuals preconditioned by P, for K = R^m only; InputError for other sets. The residual
// falls in every step, which that of cg does not; otherwise the two are alike.
Solution minres(const Problem&, const Options&);

}  // namespace amontons
