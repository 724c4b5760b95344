#pragma once
#include "amontons/solvers/driver/phases.hpp"

namespace amontons {

// Rows influence each other only through a chain of moving bodies. The VI therefore separates into
// independent ones, its islands. Solving them one by one is exact, and an easy island (a wall at rest) does
// not pay for a hard one (a chain with a heavy ball).
//
// Proof: A = D M^-1 D' + E has an entry (i, j) only where rows i and j share a body of finite mass. With the
// rows sorted by islands A is block diagonal. K is a product, so <A x + b, y - x> >= 0 holds for all y in K
// if and only if it holds for every island with the others' y = x.
//
// The tolerance is kept. F_k is the natural map of island k, and each is solved to |F_k(x)| <= tol |F_k(0)|:
//  |F(x)|^2 = sum |F_k(x)|^2 <= tol^2 sum |F_k(0)|^2 = tol^2 |F(0)|^2.
// The converse is false: an island at rest beside a hit one is solved more accurately apart than together.
//
// Small islands are solved together. Only a ContactSystem is divided into islands; another operator, and a
// solve with history or a callback, is one island. Status and reason of the Solution are those of the
// hardest.
Solution solve_by_islands(const Problem& problem, const Options& options, Budget& budget, Method method);

}  // namespace amontons
