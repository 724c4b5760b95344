// Y is stored by rows of W, padded to whole vectors, because every loop here and in Newton's method runs
// along the coordinates of one row. Sums over eight lanes give the same bits on every instruction set.
#include "solvers/direct/thin_matrix.hpp"

#include <algorithm>

#include "solvers/linear/row_kernel.hpp"

namespace amontons {

void ThinMatrix::resize(std::size_t coordinates, std::size_t m) {
  n = coordinates;
  stride = factor_stride(n);
  Y.assign(m * stride, 0.0);
  Q.clear();
  E.assign(m, 0.0);
}

void ThinMatrix::gather(std::span<const double> x, double* z) const {
  AMONTONS_DISPATCH(add_product, z, x.data(), Y.data(), rows(), stride);
}

// Q is symmetric: its rows are its columns.
void ThinMatrix::hold(double* z) const {
  if (Q.empty()) return;
  static thread_local std::vector<double> product;
  product.assign(stride, 0.0);
  AMONTONS_DISPATCH(add_product, product.data(), z, Q.data(), n, stride);
  std::copy(product.begin(), product.end(), z);
}

double ThinMatrix::diagonal(std::size_t i) const {
  double sum = E[i];
  for (std::size_t k = 0; k < n; ++k) sum += row(i)[k] * row(i)[k];
  return sum;
}

// From impulses to rates and back: two passes over Y, and one over the small Q where bilateral rows act.
void ThinMatrix::add_product(std::span<const double> x, std::span<double> u) const {
  static thread_local std::vector<double> z;
  z.assign(stride, 0.0);
  gather(x, z.data());
  hold(z.data());
  AMONTONS_DISPATCH(add_row_products, u.data(), Y.data(), z.data(), rows(), stride);
  for (std::size_t i = 0; i < rows(); ++i) u[i] += E[i] * x[i];
}

// For the central curve, which scales W by blocks and has no form in factors. Few islands come this far.
void ThinMatrix::fill(std::vector<double>& W) const {
  const std::size_t m = rows();
  W.assign(m * m, 0.0);
  std::vector<double> z;
  for (std::size_t i = 0; i < m; ++i) {
    z.assign(row(i), row(i) + stride);
    hold(z.data());
    AMONTONS_DISPATCH(add_row_products, &W[m * i], Y.data(), z.data(), m, stride);
    W[(m + 1) * i] += E[i];
  }
}

}  // namespace amontons
