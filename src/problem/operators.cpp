// Products of given matrices: one thread, sums in the order of the entries, the same bits everywhere.
// ContactSystem, the operator for bodies, has separate files.
#include "amontons/problem/operators.hpp"

#include <algorithm>

namespace amontons {

void SparseOperator::product(std::span<const double> x, std::span<double> y) const {
  const std::size_t m = rows();
  for (std::size_t i = 0; i < m; ++i) {
    double sum = 0;
    for (Index k = indptr[i]; k < indptr[i + 1]; ++k) sum += data[k] * x[indices[k]];
    y[i] = sum;
  }
}

// Entries given in several parts are summed, as in the product.
void SparseOperator::diagonal(std::span<double> d) const {
  for (std::size_t i = 0; i < rows(); ++i) {
    d[i] = 0;
    for (Index k = indptr[i]; k < indptr[i + 1]; ++k)
      if (static_cast<std::size_t>(indices[k]) == i) d[i] += data[k];
  }
}

void DenseOperator::product(std::span<const double> x, std::span<double> y) const {
  // Column sweeps: A is symmetric, so row j is column j, and y += x_j A_j vectorises without reordering a
  // sum. A row times x would be one chain of additions, which cannot be split into lanes without changing the
  // bits.
  std::fill(y.begin(), y.end(), 0.0);
  for (std::size_t j = 0; j < m; ++j) {
    const double* column = data.data() + j * m;
    const double xj = x[j];
    for (std::size_t i = 0; i < m; ++i) y[i] += xj * column[i];
  }
}

void DenseOperator::diagonal(std::span<double> d) const {
  for (std::size_t i = 0; i < m; ++i) d[i] = data[i * m + i];
}

void CallbackOperator::diagonal(std::span<double> d) const { std::copy(diag.begin(), diag.end(), d.begin()); }

}  // namespace amontons
