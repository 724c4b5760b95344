#pragma once
#include <cstdint>
#include <vector>

#include "solvers/direct/reduction.hpp"

namespace amontons {

// Sweeps over the blocks of an island (Gauss-Seidel; Jean 1999). Each block in turn moves to the solution of
// its own inequality, with the newest impulses of the others. No factorisation is made.
//
// Newton's method changes the faces of all blocks at once. More contacts may touch than a body has degrees of
// freedom, with gaps that differ a little. Then no velocity closes all of them: the face with all has no
// solution, and its impulses are as large as the proximal term allows. Most of these contacts open in the
// next step, and the body falls through the rest. The two faces alternate.
//
// A sweep lets one contact carry before it asks the next, so that some stay open. It converges slowly, but a
// face needs only the signs of x - u.
//
// By rows sweeps keep u = W x + q, and add the columns of a block that moved. By rates they keep z = Q Y x,
// from which a block forms its own u, and add rows of Y'Q. A sweep takes m^2 or 2 m n multiplications, while
// Newton's matrix takes m^3 / 3 or m n^2.
class BlockSweeps {
 public:
  // p: a mass per block.
  void start(const Reduction::Island& island, Law law, const std::vector<double>& p);
  // Forms the velocities of x, which sweeps keep from then on.
  void begin_at(const std::vector<double>& x);
  void sweep(std::vector<double>& x);
  // Multiplications since start().
  std::uint64_t work() const { return work_; }

 private:
  const Reduction::Island* island_ = nullptr;
  Law law_{};
  std::uint64_t work_ = 0;
  // Diagonal blocks of W, row-major, and a bound of the eigenvalues of each.
  std::vector<double> diagonal_, bound_;
  // Velocities W x + q; with a thin W in their place z = Q Y x, and the rows of Y'Q if Q is not 1.
  std::vector<double> u_, z_, YQ_;
};

}  // namespace amontons
