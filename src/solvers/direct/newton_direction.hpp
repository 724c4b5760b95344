#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "solvers/direct/reduction.hpp"

namespace amontons {

// The point of a step, with a mass p per block.
struct NewtonPoint {
  Law law;
  const std::vector<double>&p, &x, &u;
};

// The direction dx of a step of Newton's method for the VI of an island, docs/algorithm.md (32). Each block
// has an equation F(x, u) = 0, u = W x + q (block_equation.hpp), and dF = G dx + H du:
//
//   (G + H (W + sigma p)) dx = -F,
//
// with a proximal term about x. Blocks at a bound have H = 0, dx = -F. Only the other, active blocks are
// factored.
//
// A thin W is Y'Q Y + E. The equations of active blocks are then D dx = -F - H Y'z with z = Q Y dx. Here D is
// block-diagonal, D = G + H (E + sigma p). So dx = r - S Y'z, r = -D^-1 F, S = D^-1 H, and
//
//   (1 + Q Y S Y') z = Q Y (r + the moves of blocks at bounds)
//
// is all that is factored: one row per coordinate, however many contacts there are.
class NewtonDirection {
 public:
  // False if the matrix is singular.
  bool solve(const Reduction::Island& island, const NewtonPoint& at, double sigma, std::vector<double>& dx);
  // Multiplications of the last solve.
  std::uint64_t work() const { return work_; }

 private:
  struct Linear {
    std::size_t row, dim, column;  // the first of its rows, its size, and its first column in the matrix
    bool acts;                     // H is not zero
    double p, F[6], G[36], H[36];
  };

  void linearise(const Reduction::Island& island, const NewtonPoint& at);
  void take_bounds(const Reduction::Island& island, std::vector<double>& dx);
  void fill(const Reduction::Island& island, double sigma);
  template <bool adds>
  void add_active(const double* w, double h, double* J) const;
  bool solve_by_rates(const ThinMatrix& W, double sigma, std::vector<double>& dx);
  bool reduce_block(const ThinMatrix& W, double sigma, const Linear& l);

  // Rows of active blocks that follow each other: [first, end).
  struct Run {
    std::size_t first, end;
  };

  std::vector<Linear> linear_;
  std::vector<Run> runs_;
  std::vector<std::size_t> active_, pivots_;
  std::vector<double> J_, columns_, rhs_, du_;
  // By rates: per active row its number in W and its r; the rows S Y; z.
  std::vector<std::size_t> rows_;
  std::vector<double> r_, T_, z_, S_;
  std::uint64_t work_ = 0;
};

}  // namespace amontons
