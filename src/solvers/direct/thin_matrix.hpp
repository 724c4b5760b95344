// W of an island with more rows than coordinates, in factors.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace amontons {

// W = Y'Q Y + E with n coordinates and m > n rows: Y is n x m, Q n x n and symmetric, E diagonal. Q is what
// bilateral rows leave of the unit matrix. A product with W takes 2 m n multiplications in place of m^2, and
// Newton's matrix has n rows (newton_direction.hpp). Empty, with n = 0, where W itself is stored.
//
// A robot with servos that stands on four feet is an example: 18 coordinates, 12 efforts of servos and 12
// contacts of three rows. W has 48 x 48 entries of rank 18 besides E.
struct ThinMatrix {
  std::size_t n = 0, stride = 0;  // coordinates; distance of rows of Y' and Q, zeros pad them
  std::vector<double> Y;          // row i of Y' belongs to row i of W
  std::vector<double> Q;          // empty: the unit matrix
  std::vector<double> E;          // per row

  bool empty() const { return n == 0; }
  std::size_t rows() const { return E.size(); }
  const double* row(std::size_t i) const { return Y.data() + stride * i; }

  // Room for m rows over n coordinates, all zero.
  void resize(std::size_t coordinates, std::size_t m);
  // z += s Y x and z := Q z; z has `stride` entries.
  void gather(std::span<const double> x, double* z) const;
  void hold(double* z) const;
  // Entry i of diag(Y'Y + E), at least that of diag(W).
  double diagonal(std::size_t i) const;
  // u += W x.
  void add_product(std::span<const double> x, std::span<double> u) const;
  // N := 1 + Q sum_i y_i t_i' over the rows of Y and of T, n rows `stride` apart. T has one row for each of
  // `rows`, in their order, and room for terms() numbers.
  void add_terms(std::span<const std::size_t> rows, std::span<double> T, std::vector<double>& N) const;
  std::size_t terms() const { return (rows() + 5) * stride; }
};

}  // namespace amontons
