// Private: the problem that remains without bilateral rows, for methods that need only products.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "amontons/solvers/driver/driver.hpp"
#include "solvers/direct/mechanism.hpp"

namespace amontons {

// As Reduction, docs/algorithm.md (31), but W is not formed. In every product, bodies connected by bilateral
// rows move by [K^-1]_vv in place of M^-1. A chain of joints, or a heavy ball on it, then costs a first-order
// method no iteration, and joints hold exactly whenever the method stops.
class ConstrainedProblem {
 public:
  ConstrainedProblem() = default;
  ConstrainedProblem(const ConstrainedProblem&) = delete;
  ConstrainedProblem& operator=(const ConstrainedProblem&) = delete;

  // False where it does not apply: no bodies, no bilateral rows, or a factorisation that fails or takes too
  // long. The problem must outlive it.
  bool make(const Problem& problem, Law law);
  const Problem& rest() const { return rest_; }
  std::size_t bodies() const { return held_.size(); }

  // A run on the remaining rows whose x, residuals and tolerance are those of the whole problem.
  std::unique_ptr<Run> start(Starter starter, const Options& options, Budget& budget);

  const Problem& whole() const { return *problem_; }
  // Ratio of residuals, whole problem to remaining rows: each is relative to that of zero impulses.
  double ratio() const { return ratio_; }
  void restrict_to_rest(std::span<const double> x, std::vector<double>& rest) const;
  // x of the whole, bilateral rows included.
  void extend(std::span<const double> rest, std::vector<double>& x);
  // Corrects bilateral impulses by the error in u that the rounding of K left there.
  void correct(std::span<const double> u, std::span<double> x) { mechanism_.correct(u, x, z_); }

 private:
  const Problem* problem_ = nullptr;
  Mechanism mechanism_;
  Problem rest_;
  std::vector<std::size_t> row_;  // row in the whole problem, for each remaining row
  std::vector<Index> held_;
  std::vector<double> wrenches_, z_;
  double ratio_ = 1;
};

}  // namespace amontons
