#pragma once
#include <vector>

#include "amontons/sets/barriers.hpp"
#include "solvers/elimination/reduction.hpp"

namespace amontons {

// A primal-dual interior point for a VI of few rows with its matrix at hand, docs/algorithm.md (35). As that
// of second_order, but for the De Saxce term: its derivative is part of Newton's equation, and it is smooth
// on the central path. The matrix is not symmetric, and a few of its dense factorisations are the work.
// Under coulomb the path ends at a solution where nothing else does: friction that jams, light links between
// heavy ones, joints at their limits.
class SmallInterior {
 public:
  // How the path is followed, in parts of mu: the size at which the kink of the De Saxce term is rounded off
  // (of velocities), 0.01 to 1, and the least that a step aims at. Where one way leads astray another may
  // not.
  struct Way {
    double rounding, least_target;
  };
  // In the middle of the sets. mobility: the mean of diag(W) per block, positive (1/kg). The island must
  // outlive it, and its q is not zero.
  void start(const Reduction::Island& island, Law law, std::span<const double> mobility, Way way);
  // One step along the path; false if there is no way on.
  bool step();
  // Inside the sets.
  void x(std::vector<double>& out);

 private:
  void linearise();
  bool assemble();
  bool solve(double target, bool corrector);
  template <class F>
  void each(F&& f) {
    barriers_.each(island_->K, f);
  }
  double longest_step();
  double gap(double t);

  const Reduction::Island* island_ = nullptr;
  Law law_{};
  Barriers barriers_;
  Way way_{};
  double beta_ = 1, degree_ = 0;
  std::vector<double> unit_;         // of x, per block (N s)
  std::vector<std::size_t> offset_;  // of the matrices of a block
  std::vector<double> R_, T_;        // of the barriers, B T
  std::vector<double> F_, x_, u_, K_, rho_, z_;
  std::vector<std::size_t> pivots_;
};

}  // namespace amontons
