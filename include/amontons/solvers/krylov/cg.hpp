#pragma once
#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

// "cg": conjugate gradients preconditioned by P, for K = R^m only; InputError for other sets. The reference
// for joints without contacts.
Solution cg(const Problem&, const Options&, Budget&);
// As runs. The caller must ensure K = R^m. The second is preconditioned by one factorisation of A, so that
// long chains of joints take a few iterations. Its A must allow a factorisation: it must not be a function.
std::unique_ptr<Run> start_cg(const Problem&, const Options&, Budget&);
std::unique_ptr<Run> start_factored_cg(const Problem&, const Options&, Budget&);

}  // namespace amontons
