#pragma once
#include "amontons/solvers/driver/phases.hpp"

namespace amontons {

// Contacts and joints that no chain of moving bodies connects do not feel each other: the VI falls apart into
// independent ones, its islands. Solving them one by one is exact, and an easy island (a wall at rest) does
// not pay for a hard one (a chain with a heavy ball).
//
// Exact: A = D M^-1 D' + E has an entry (i, j) only where rows i and j share a body of finite mass, so with
// the rows sorted by islands A is block diagonal; K is a product, and <A x + b, y - x> >= 0 for all y in K
// holds if and only if it holds for every island with the others' y = x.
//
// The tolerance is kept: with F_k the natural map of island k, each solved to |F_k(x)| <= tol |F_k(0)|, it is
// |F(x)|^2 = sum |F_k(x)|^2 <= tol^2 sum |F_k(0)|^2 = tol^2 |F(0)|^2. The converse is false: to solve them
// apart asks more of an island at rest beside one that is hit.
//
// Small islands are solved together. Islands of a ContactSystem are found; everything else, and a solve with
// history or a callback, is one island. What the Solution says in words is said of the hardest.
//
// Each is solved to the tolerance by itself (`each`), so that a wall at rest does not creep because a ball
// flies about elsewhere; or to what the whole leaves it (`whole`), for which, with n islands,
//   tol_k^2 |F_k(0)|^2 = tol^2 (|F_k(0)|^2 + |F(0)|^2 / n) / 2,   whose sum over k is tol^2 |F(0)|^2.
enum class ToleranceOf : unsigned char { each, whole };
Solution solve_by_islands(const Problem& problem, const Options& options, Method method,
                          ToleranceOf tolerance = ToleranceOf::each);

}  // namespace amontons
