#pragma once
#include <span>

#include "amontons/problem/problem.hpp"

namespace amontons {

// True if d proves that the VI has no solution: d in the recession cone of K with A d = 0 and <b, d> < 0. For
// any solution x (take y = x + d in the VI) <b, d> = <A x + b, d> would be >= 0, a contradiction. In
// mechanics, no velocity satisfies the constraints and the impulses grow along d without bound. Under coulomb
// the De Saxce term adds mu |u_t| d_n >= 0 to b. The proof is then not valid, and the function returns false
// for problems with friction.
//
// Numerical criterion, with |d|_P = 1: the distance to the cone and |P^-1/2 A d| at most `tolerance`, and <b,
// d> below -1e-3 of |P^-1/2 b|. One product.
bool proves_infeasible(const Problem& problem, Law law, std::span<const double> d, double tolerance = 1e-9);

}  // namespace amontons
