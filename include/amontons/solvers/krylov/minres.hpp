#pragma once
#include "amontons/base/budget.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "minres": minimal residuals preconditioned by P, for K = R^m only; InputError for other sets. In contrast
// to cg, the residual falls in every step.
Solution minres(const Problem&, const Options&, Budget&);

}  // namespace amontons
