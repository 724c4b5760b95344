#pragma once
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// "cg": conjugate gradients preconditioned by P, for K = R^m only; InputError for other sets. The reference
// for joints without contacts.
Solution cg(const Problem&, const Options&);
// The same, preconditioned by one factorisation of A, so that long chains of joints take a few iterations.
// Asks for an A that can be factored: not for a function. K = R^m is up to the caller.
Solution factored_cg(const Problem&, const Options&);

}  // namespace amontons
