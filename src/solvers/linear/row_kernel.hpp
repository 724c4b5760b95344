#pragma once
#include <cstddef>

#include "amontons/base/isa.hpp"

namespace amontons {

// Parameters of factor_rows: columns that are factored together, and the distance of rows of m numbers.
constexpr std::size_t factor_columns = 8;
constexpr std::size_t factor_stride(std::size_t m) {
  return (m + factor_columns - 1) / factor_columns * factor_columns;
}

// The 6 x 6 blocks that pairs of blocks change, in the order of the pairs: t in `blocks`, or -1 - t in
// `diagonal`.
struct PairTargets {
  const std::ptrdiff_t* next;
  double *diagonal, *blocks;
};

// Loops along rows of small dense matrices. Entries are independent of each other, and the terms of each are
// added in one order, so that all instruction sets give the same bits.
AMONTONS_FOR_EACH_ISA(
    // to[0..n) += sum_k f[k] from[k stride + 0..n) over six rows, in their order.
    void add_six_rows(double* to, const double* f, const double* from, std::size_t stride, std::size_t n);
    // to_i -= s sum_k U[6 k + i] w_k for six rows of n numbers each, those of `to` `stride` apart, of w n.
    void subtract_six_rows(double* to, std::size_t stride, const double* U, double s, const double* w,
                           std::size_t n);
    // s A = Q Q' with Q lower triangular; A symmetric, 6 x 6. A := R, the factors that divide by Q: 1 / Q_ii
    // and below them -Q_ik / Q_ii; above them A stays. The rounding of an inverse of Q would grow with its
    // condition. Pivots below `least` are raised to it. False if one is not positive.
    bool factor_six(double* A, double s, const double* least);
    // Divides six rows by Q: in their order row i := sum_{k <= i} R[6 i + k] row k.
    void divide_six_rows(const double* R, double* rows, std::size_t n);
    // For a node of QuasidefiniteFactor with the factors R of its pivot (null: the unit matrix). Its `count`
    // blocks B := Q^-1 B, and the blocks that pairs of them change, C -= s B_a'B_c.
    void eliminate_six(const double* R, double* own, std::size_t count, double s, PairTargets to);
    // The upper half of W += s Y'Y, Y six rows of n numbers, `stride` apart; rows of W lie `m` apart.
    void add_gram(double* W, std::size_t m, const double* Y, std::size_t stride, std::size_t n, double s);
    // y += A'x, A of `rows` rows of n numbers.
    void add_product(double* y, const double* x, const double* A, std::size_t rows, std::size_t n);
    // y += A z, the same A; n is a multiple of eight.
    void add_row_products(double* y, const double* A, const double* z, std::size_t rows, std::size_t n);
    // T := S Y, d rows of n numbers each, a multiple of eight.
    void multiply_rows(double* T, const double* S, const double* Y, std::size_t d, std::size_t n);
    // N += L'T, six rows each of L and T, with `count` columns in L. All rows are `stride` numbers, a
    // multiple of eight.
    void add_outer(double* N, const double* L, const double* T, std::size_t count, std::size_t stride);
    // A = P L U with row pivots, in place. A is m x m with rows `stride` = factor_stride(m) apart; the
    // padding changes. The unit diagonal of L is not stored. `columns`: scratch of m factor_columns numbers.
    // False if singular.
    bool factor_rows(double* A, std::size_t* pivots, std::size_t m, std::size_t stride, double* columns);
    // Overwrites b by x of A x = b, from these factors. False if it is not finite.
    bool solve_rows(const double* A, const std::size_t* pivots, double* b, std::size_t m,
                    std::size_t stride);)

}  // namespace amontons
