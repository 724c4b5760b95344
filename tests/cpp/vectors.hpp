#pragma once
#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "amontons/problem/problem.hpp"

// Dense vectors of the tests, and matrices as their rows one after the other.
namespace small {

using Vector = std::vector<double>;

// x of A x = b, dense, by elimination with the largest pivots: the reference.
inline Vector solve_dense(Vector A, Vector b) {
  const std::size_t m = b.size();
  for (std::size_t k = 0; k < m; ++k) {
    std::size_t best = k;
    for (std::size_t i = k; i < m; ++i)
      if (std::abs(A[m * i + k]) > std::abs(A[m * best + k])) best = i;
    for (std::size_t j = 0; j < m; ++j) std::swap(A[m * k + j], A[m * best + j]);
    std::swap(b[k], b[best]);
    for (std::size_t i = k + 1; i < m; ++i) {
      const double f = A[m * i + k] / A[m * k + k];
      for (std::size_t j = k; j < m; ++j) A[m * i + j] -= f * A[m * k + j];
      b[i] -= f * b[k];
    }
  }
  for (std::size_t k = m; k-- > 0;) {
    for (std::size_t j = k + 1; j < m; ++j) b[k] -= A[m * k + j] * b[j];
    b[k] /= A[m * k + k];
  }
  return b;
}

inline double largest_difference(const Vector& a, const Vector& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

inline double largest(const Vector& a) { return largest_difference(a, Vector(a.size())); }

inline bool same_bits(const Vector& a, const Vector& b) {
  return a.size() == b.size() && (a.empty() || !std::memcmp(a.data(), b.data(), a.size() * sizeof(double)));
}

// u = A x + b.
inline Vector velocities(const amontons::Problem& problem, const Vector& x) {
  Vector u(x.size());
  amontons::product(problem.A, x, u);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += problem.b[i];
  return u;
}

}  // namespace small
