#pragma once
#include "amontons/solvers/driver/phases.hpp"

namespace amontons {

// Contacts and joints that no chain of moving bodies connects do not feel each other: the VI falls apart into
// independent ones, its islands. Solving them one by one is exact, and an easy island (a wall at rest) does
// not pay for a hard one (a chain with a heavy ball). Each is solved to the tolerance relative to its own
// residual at zero, which implies the tolerance of the whole. Small islands are solved together.
//
// Islands of a ContactSystem are found; everything else, and a solve with history or a callback, is one
// island.
Solution solve_by_islands(const Problem& problem, const Options& options, Method method);

}  // namespace amontons
