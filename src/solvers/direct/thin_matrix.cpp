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

// Six rows at a time, the last ones filled up by zeros. A row of Y has entries on the way from its bodies to
// the root only. Coordinates that none of the six rows reaches are passed over by the kernel.
void ThinMatrix::add_terms(std::span<const std::size_t> rows, std::span<double> T,
                           std::vector<double>& N) const {
  constexpr std::size_t group = 6;  // not tuned: rows of the kernel
  static thread_local std::vector<double> six, held;
  N.assign(n * stride, 0.0);
  std::fill_n(&T[rows.size() * stride], (group - 1) * stride, 0.0);
  for (std::size_t i = 0; i < rows.size(); i += group) {
    six.assign(group * stride, 0.0);
    for (std::size_t k = 0; k < std::min(group, rows.size() - i); ++k)
      std::copy_n(row(rows[i + k]), stride, &six[stride * k]);
    AMONTONS_DISPATCH(add_outer, N.data(), six.data(), &T[stride * i], n, stride);
  }
  if (!Q.empty()) {
    held.assign(n * stride, 0.0);
    for (std::size_t i = 0; i < n; ++i)
      AMONTONS_DISPATCH(add_product, &held[stride * i], &Q[stride * i], N.data(), n, stride);
    N.swap(held);
  }
  for (std::size_t i = 0; i < n; ++i) N[(stride + 1) * i] += 1;
}

}  // namespace amontons
