#pragma once
#include <cstddef>
#include <functional>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "amontons/problem/contact_system.hpp"

namespace amontons {

// The operators A of the VI. All are symmetric positive semidefinite m x m maps from impulses (N s) to
// constraint velocities (m/s). Each offers
//   rows()          m
//   product(x, y)   y = A x, one "product" of the solver's count; x and y do not overlap
//   diagonal(d)     d = diag(A)
// Matrices are viewed, not copied: `owner` keeps the memory alive.

// Compressed sparse rows of the whole matrix (both triangles): scipy.sparse.csr_array as it lies in memory.
struct SparseOperator {
  std::span<const Index> indptr, indices;  // m + 1, nnz
  std::span<const double> data;            // nnz
  std::shared_ptr<const void> owner;

  std::size_t rows() const { return indptr.size() - 1; }
  void product(std::span<const double> x, std::span<double> y) const;
  void diagonal(std::span<double> d) const;
};

// Row-major (equivalently column-major: A is symmetric) m x m.
struct DenseOperator {
  std::span<const double> data;  // m * m
  std::size_t m = 0;
  std::shared_ptr<const void> owner;

  std::size_t rows() const { return m; }
  void product(std::span<const double> x, std::span<double> y) const;
  void diagonal(std::span<double> d) const;
};

// A function y = A x of the caller; `diag` is diag(A), or ones if unknown (then P = I). Any iteration may
// call it, and it must always give the same result. Methods that factor reject it.
struct CallbackOperator {
  std::function<void(std::span<const double>, std::span<double>)> function;
  std::vector<double> diag;

  std::size_t rows() const { return diag.size(); }
  void product(std::span<const double> x, std::span<double> y) const { function(x, y); }
  void diagonal(std::span<double> d) const;
};

using Operator = std::variant<SparseOperator, DenseOperator, CallbackOperator, ContactSystem>;

// The same for an operator of any kind: one branch per product, none inside. Methods that iterate visit the
// operator once, outside their loop.
inline std::size_t rows(const Operator& A) {
  return std::visit([](const auto& op) { return op.rows(); }, A);
}
inline void product(const Operator& A, std::span<const double> x, std::span<double> y) {
  std::visit([&](const auto& op) { op.product(x, y); }, A);
}
inline void diagonal(const Operator& A, std::span<double> d) {
  std::visit([&](const auto& op) { op.diagonal(d); }, A);
}

}  // namespace amontons
