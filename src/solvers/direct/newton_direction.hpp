#pragma once
#include <cstddef>
#include <vector>

#include "solvers/direct/reduction.hpp"

namespace amontons {

// The direction dx of a step of Newton's method for the VI of an island, docs/algorithm.md (33). Each block
// has an equation F(x, u) = 0, u = W x + q (block_equation.hpp), and dF = G dx + H du:
//
//   (G + H (W + sigma p)) dx = -F,
//
// with a proximal term about x. Blocks at a bound have H = 0, dx = -F. Only the other, active blocks are
// factored.
class NewtonDirection {
 public:
  // p: a mass per block. False if the matrix is singular.
  bool solve(const Reduction::Island& island, Law law, const std::vector<double>& p, double sigma,
             const std::vector<double>& x, const std::vector<double>& u, std::vector<double>& dx);
  // Number of rows that the last solve factored.
  std::size_t rows() const { return rhs_.size(); }

 private:
  struct Linear {
    std::size_t row, dim, column;  // the first of its rows, its size, and its first column in the matrix
    bool acts;                     // H is not zero
    double p, F[6], G[36], H[36];
  };

  void linearise(const Reduction::Island& island, Law law, const std::vector<double>& p,
                 const std::vector<double>& x, const std::vector<double>& u);
  void take_bounds(const Reduction::Island& island, std::vector<double>& dx);
  void fill(const Reduction::Island& island, double sigma);
  void add_active(const double* w, double h, double* J) const;

  // Rows of active blocks that follow each other: [first, end).
  struct Run {
    std::size_t first, end;
  };

  std::vector<Linear> linear_;
  std::vector<Run> runs_;
  std::vector<std::size_t> active_, pivots_;
  std::vector<double> J_, columns_, rhs_, du_;
};

}  // namespace amontons
