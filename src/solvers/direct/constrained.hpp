// Private: the problem of the rows that bilateral rows leave, for methods that need products alone.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "amontons/solvers/driver/driver.hpp"
#include "solvers/direct/mechanism.hpp"

namespace amontons {

// As Reduction, docs/algorithm.md (32), but W is not formed: bodies that bilateral rows hold together move by
// [K^-1]_vv in the place of M^-1, in every product. A chain of joints, or a heavy ball on it, then costs a
// first-order method no iteration, and joints hold exactly wherever it is stopped.
class ConstrainedProblem {
 public:
  ConstrainedProblem() = default;
  ConstrainedProblem(const ConstrainedProblem&) = delete;
  ConstrainedProblem& operator=(const ConstrainedProblem&) = delete;

  // False where it does not apply: no bodies, no bilateral rows, a factorisation that fails or takes too
  // long. The problem must outlive it.
  bool make(const Problem& problem, Law law);
  const Problem& rest() const { return rest_; }
  std::size_t bodies() const { return held_.size(); }

  // A run on the rest that speaks of the whole: x, residuals and tolerance are those of the whole problem.
  std::unique_ptr<Run> start(Starter starter, const Options& options);

  const Problem& whole() const { return *problem_; }
  // Residuals of the rest times this are those of the whole: both are relative to that of zero impulses.
  double ratio() const { return ratio_; }
  void restrict_to_rest(std::span<const double> x, std::vector<double>& rest) const;
  // x of the whole, bilateral rows included.
  void extend(std::span<const double> rest, std::vector<double>& x);
  // Changes bilateral impulses by what the rounding of K has left of u there.
  void correct(std::span<const double> u, std::span<double> x) { mechanism_.correct(u, x, z_); }

 private:
  const Problem* problem_ = nullptr;
  Mechanism mechanism_;
  Problem rest_;
  std::vector<std::size_t> row_;  // of the whole, for each row of the rest
  std::vector<Index> held_;
  std::vector<double> wrenches_, z_;
  double ratio_ = 1;
};

}  // namespace amontons
