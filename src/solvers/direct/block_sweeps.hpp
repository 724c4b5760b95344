#pragma once
#include <cstdint>
#include <vector>

#include "solvers/direct/reduction.hpp"

namespace amontons {

// Sweeps over the blocks of an island: each in turn moves to the solution of its own inequality, with the
// newest impulses of the others (Gauss-Seidel; Jean 1999). No factorisation is made.
//
// Newton's method changes the faces of all blocks at once. Where more contacts touch than a body has degrees
// of freedom, a face with all of them has no solution, and one without them none either, so that it
// alternates. A sweep lets one block carry before it asks the next.
class BlockSweeps {
 public:
  // p: a mass per block.
  void start(const Reduction::Island& island, Law law, const std::vector<double>& p);
  void sweep(std::vector<double>& x);
  // Multiplications since start().
  std::uint64_t work() const { return work_; }

 private:
  void start_velocities(const std::vector<double>& x);

  const Reduction::Island* island_ = nullptr;
  Law law_{};
  std::uint64_t work_ = 0;
  // Diagonal blocks of W, row-major, and a bound of the eigenvalues of each.
  std::vector<double> diagonal_, bound_;
  // Velocities W x + q; with a thin W in their place z = Q Y x, and the rows of Y'Q if Q is not 1.
  std::vector<double> u_, z_, YQ_;
};

}  // namespace amontons
