// Linear systems of one block, of at most six rows.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <type_traits>

namespace amontons {

// Calls f with the size of a block. That of a contact is a constant: loops over its three rows unroll, and
// its sums keep their terms and their order.
template <class F>
void with_size(int dim, F&& f) {
  dim == 3 ? f(std::integral_constant<int, 3>{}) : f(dim);
}

// Solves D X = B in place of B = X, `width` numbers per row, by Gauss' method with row pivots; D changes.
// Returns the sign of det D, 0 if D is singular: the product of the signs of the pivots, and one change for
// each exchange of rows.
//
// Most blocks of a robot have one row, of a servo, a limit or dry friction along a joint, and need a
// division.
inline int solve_block(std::size_t dim, double* D, double* X, std::size_t width) {
  const auto sign_of = [](double pivot) { return pivot > 0 ? 1 : pivot < 0 ? -1 : 0; };
  if (dim == 1) {
    for (std::size_t j = 0; j < width; ++j) X[j] /= D[0];
    return sign_of(D[0]);
  }
  int sign = 1;
  for (std::size_t k = 0; k < dim; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < dim; ++i)
      if (std::abs(D[dim * i + k]) > std::abs(D[dim * best + k])) best = i;
    sign *= sign_of(D[dim * best + k]);
    if (sign == 0) return 0;
    if (best != k) {
      sign = -sign;
      std::swap_ranges(D + dim * k, D + dim * (k + 1), D + dim * best);
      std::swap_ranges(X + width * k, X + width * (k + 1), X + width * best);
    }
    for (std::size_t i = k + 1; i < dim; ++i) {
      const double share = D[dim * i + k] / D[dim * k + k];
      if (share == 0) continue;
      for (std::size_t j = k; j < dim; ++j) D[dim * i + j] -= share * D[dim * k + j];
      for (std::size_t j = 0; j < width; ++j) X[width * i + j] -= share * X[width * k + j];
    }
  }
  for (std::size_t k = dim; k-- > 0;)
    for (std::size_t j = 0; j < width; ++j) {
      double sum = X[width * k + j];
      for (std::size_t i = k + 1; i < dim; ++i) sum -= D[dim * k + i] * X[width * i + j];
      X[width * k + j] = sum / D[dim * k + k];
    }
  return sign;
}

}  // namespace amontons
