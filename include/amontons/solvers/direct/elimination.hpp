#pragma once
#include <memory>
#include <span>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// The direct way of `auto`, for mechanisms with few contacts: bilateral rows (sets Free) are eliminated by a
// sparse factorisation over bodies and joints, what remains is a small VI with a dense matrix for each
// island, and bilateral impulses follow from its solution. Exact: x solves the VI of the problem, and the
// residual is measured on it.
//
// What is kept between calls is memory, and the analysis of the mechanism, which is made anew when that
// changes: no result depends on it.
class Elimination {
 public:
  Elimination();
  Elimination(Elimination&&) noexcept;
  Elimination& operator=(Elimination&&) noexcept;
  ~Elimination();

  // Whether it was tried on this problem: no matrix or function, islands of few rows, options without
  // history and callback. If so `s` is the answer, converged or the best that a bounded amount of work found;
  // its arrays keep their memory, so that a step of a simulation allocates nothing here.
  bool solve(const Problem& problem, const Options& options, Solution& s);

  // After a solve() that did not converge, with the same problem and options: the islands that fell short, by
  // a solver of problems with a dense matrix. Contacts know there of all that the joints do to their bodies,
  // which first-order methods on the whole problem have to find out, and where factors are small. `s` is
  // better then, or as it was; false where no island fell short: rounding is what is left.
  using DenseSolver = Solution (*)(const Problem&, const Options&);
  bool solve_again(const Problem& problem, const Options& options, DenseSolver solver, Solution& s);

  // For solves that stopped early: what they leave does no harm. Bilateral impulses are exactly those that
  // belong to the others, so that joints hold; and the others are scaled, all alike and down, to where they
  // do not give energy in sum. The residual may rise by that. u of s is that of its x, or empty. False where
  // it does not apply: no bodies, or a mechanism without factorisation.
  bool settle(const Problem& problem, const Options& options, Solution& s);

  // Changes x of the bilateral rows to the impulses that belong to those of the others, so that joints hold
  // exactly. False, with x as it was, where there are no bodies or the mechanism has no factorisation.
  bool restore_joints(const Problem& problem, std::span<double> x);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace amontons
