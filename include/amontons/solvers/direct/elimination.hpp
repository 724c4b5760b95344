#pragma once
#include <memory>
#include <span>

#include "amontons/base/budget.hpp"
#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// The direct way of `auto`, for mechanisms with few contacts. A sparse factorisation over bodies and joints
// eliminates bilateral rows (sets Bilateral). A small VI with a dense matrix remains for each island.
// Bilateral impulses follow from its solution. The way is exact: x solves the VI of the problem, and the
// residual is measured on that problem.
//
// Memory and the analysis of the mechanism are kept between calls. The analysis is repeated when the
// mechanism changes. No result depends on it.
class Elimination {
 public:
  Elimination();
  ~Elimination();

  // Tries the direct way; false if it does not apply. It applies if the operator is neither a matrix nor a
  // function, islands have few rows, and the options ask for no history and no callback. Then `s` is the
  // answer: converged, or the best x that a bounded amount of work found. Its arrays keep their memory, so
  // that a step of a simulation allocates nothing here.
  bool solve(const Problem& problem, const Options& options, Budget& budget, Solution& s);

  // After a solve() that did not converge: true if the solver of an island failed. False if only rounding
  // remains, which no other method reduces.
  bool fell_short() const;

  // Replaces the impulses x of bilateral rows by those that hold the joints exactly for the given impulses of
  // the other rows. Returns false, with x unchanged, if there are no bodies or the mechanism has no
  // factorisation.
  bool restore_joints(const Problem& problem, std::span<double> x);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace amontons
