#pragma once
#include <span>
#include <vector>

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

// Some islands as a problem of their own, with bodies numbered in the order of their appearance. Beside trees
// all bodies keep their numbers.
struct IslandPart {
  Problem problem;
  // Row and body of the whole problem for every row and body of the part: x_part[k] = x[rows[k]].
  std::vector<std::size_t> rows;
  std::vector<Index> bodies;
};
// The part of some blocks, ascending, of a ContactSystem, which must be whole islands. The arrays of `part`
// keep their memory. `body_number` is scratch, -1 or empty before and -1 after: one for all parts, so that
// the cost of many parts is linear in the whole.
void extract(const Problem& whole, std::span<const std::size_t> members, std::vector<Index>& body_number,
             IslandPart& part);

}  // namespace amontons
