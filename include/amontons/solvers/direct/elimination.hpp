#pragma once
#include <memory>
#include <span>

#include "amontons/solvers/driver/options.hpp"

namespace amontons {

// The direct way of `auto`, for mechanisms with few contacts: bilateral rows (sets Bilateral) are eliminated
// by a sparse factorisation over bodies and joints, what remains is a small VI with a dense matrix for each
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

  // After a solve() that did not converge: whether the solver of islands failed. Otherwise rounding is what
  // is left, and no other method would come nearer.
  bool fell_short() const;

  // Changes x of the bilateral rows to the impulses that belong to those of the others, so that joints hold
  // exactly. False, with x as it was, where there are no bodies or the mechanism has no factorisation.
  bool restore_joints(const Problem& problem, std::span<double> x);

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace amontons
