// A kernel (base/isa.hpp): compiled once per instruction set, without inline functions of the standard
// library. Six rows at a time, because blocks are 6 x 6: one load and store of the target for six products.
#include "solvers/linear/row_kernel.hpp"

#include "amontons/base/native_vector.hpp"

namespace amontons::AMONTONS_ISA {

namespace {

using Two __attribute__((vector_size(16), aligned(8), may_alias)) = double;
#if defined(__AVX2__)
using Four __attribute__((vector_size(32), aligned(8), may_alias)) = double;
#endif

// Names of vector types: a template argument would lose the alignment of its type.
struct Whole {
  using Vector = LooseVec;
};
#if defined(__AVX512F__)
struct OfFour {
  using Vector = Four;
};
#endif
#if defined(__AVX2__)
struct OfTwo {
  using Vector = Two;
};
#endif
struct OfOne {
  using Vector = double;
};

// Calls visit.operator()<Name>(j) for vectors of numbers from j up to n: whole vectors as long as they fit,
// the remainder in halves. Every number gets the same operations in any vector.
template <class Visit>
inline void for_each_vector(std::size_t j, std::size_t n, const Visit& visit) {
  for (; j + width <= n; j += width) visit.template operator()<Whole>(j);
#if defined(__AVX512F__)
  if (j + 4 <= n) {
    visit.template operator()<OfFour>(j);
    j += 4;
  }
#endif
#if defined(__AVX2__)
  if (j + 2 <= n) {
    visit.template operator()<OfTwo>(j);
    j += 2;
  }
#endif
  if (j < n) visit.template operator()<OfOne>(j);
}

// The terms of an entry are added in the order of the rows, which keeps the bits.
inline void add_rows(double* __restrict to, const double* f, const double* __restrict from,
                     std::size_t stride, std::size_t n) {
  const double *r0 = from, *r1 = r0 + stride, *r2 = r1 + stride, *r3 = r2 + stride, *r4 = r3 + stride,
               *r5 = r4 + stride;
  for_each_vector(0, n, [&]<class Name>(std::size_t j) {
    using V = typename Name::Vector;
    V t = *(const V*)(to + j);
    t += f[0] * *(const V*)(r0 + j);
    t += f[1] * *(const V*)(r1 + j);
    t += f[2] * *(const V*)(r2 + j);
    t += f[3] * *(const V*)(r3 + j);
    t += f[4] * *(const V*)(r4 + j);
    t += f[5] * *(const V*)(r5 + j);
    *(V*)(to + j) = t;
  });
}

inline void subtract_scaled(double* __restrict y, const double* __restrict x, double a, std::size_t n) {
  for_each_vector(0, n, [&]<class Name>(std::size_t i) {
    using V = typename Name::Vector;
    *(V*)(y + i) -= a * *(const V*)(x + i);
  });
}

// A row of six numbers in registers: four and two, or three times two. The operations on each number are the
// same for both.
#if defined(__AVX2__)
struct Six {
  Four a = {};
  Two b = {};
  void add(double f, const double* row) {
    a += f * *(const Four*)row;
    b += f * *(const Two*)(row + 4);
  }
  void store(double* row) const {
    *(Four*)row = a;
    *(Two*)(row + 4) = b;
  }
  void subtract(double f, double* row) const {
    *(Four*)row -= f * a;
    *(Two*)(row + 4) -= f * b;
  }
  void subtract(double f, const Six& row) {
    a -= f * row.a;
    b -= f * row.b;
  }
  double operator[](int i) const { return i < 4 ? a[i] : b[i - 4]; }
};
#else
struct Six {
  Two a[3] = {};
  void add(double f, const double* row) {
    for (int k = 0; k < 3; ++k) a[k] += f * *(const Two*)(row + 2 * k);
  }
  void store(double* row) const {
    for (int k = 0; k < 3; ++k) *(Two*)(row + 2 * k) = a[k];
  }
  void subtract(double f, double* row) const {
    for (int k = 0; k < 3; ++k) *(Two*)(row + 2 * k) -= f * a[k];
  }
  void subtract(double f, const Six& row) {
    for (int k = 0; k < 3; ++k) a[k] -= f * row.a[k];
  }
  double operator[](int i) const { return a[i / 2][i % 2]; }
};
#endif

// B := Q^-1 B by the factors R of factor_six: each row takes those before it.
inline void divide_lower(const double* R, double* B) {
  for (int i = 0; i < 6; ++i) {
    Six row;
    for (int k = 0; k <= i; ++k) row.add(R[6 * i + k], B + 6 * k);
    row.store(B + 6 * i);
  }
}

// C -= s A'B
inline void subtract_product(const double* A, const double* B, double s, double* C) {
  for (int i = 0; i < 6; ++i) {
    Six row;
    for (int k = 0; k < 6; ++k) row.add(A[6 * k + i], B + 6 * k);
    row.subtract(s, C + 6 * i);
  }
}

// std::abs would be an inline function of the library.
inline double size(double v) { return v < 0 ? -v : v; }

// <a, b>, eight sums in a fixed order.
inline double product_of_rows(const double* a, const double* b, std::size_t n) {
  double lanes[8] = {}, rest = 0;
  std::size_t i = 0;
  for (; i + 8 <= n; i += 8)
    for (int q = 0; q < 8; q += width)
      *(LooseVec*)(lanes + q) += *(const LooseVec*)(a + i + q) * *(const LooseVec*)(b + i + q);
  for (; i < n; ++i) rest += a[i] * b[i];
  return (((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]))) +
         rest;
}

// Columns that are factored before the rest of the matrix is updated.
constexpr std::size_t panel_columns = factor_columns;
static_assert(panel_columns % width == 0);

// The first of the largest in size.
inline std::size_t largest_of(const double* c, std::size_t n) {
  double lanes[width] = {};
  std::size_t i = 0;
  for (; i + width <= n; i += width)
    for (int q = 0; q < width; ++q) lanes[q] = size(c[i + q]) > lanes[q] ? size(c[i + q]) : lanes[q];
  double most = 0;
  for (int q = 0; q < width; ++q) most = lanes[q] > most ? lanes[q] : most;
  for (; i < n; ++i) most = size(c[i]) > most ? size(c[i]) : most;
  for (i = 0; i < n && size(c[i]) != most;) ++i;
  return i < n ? i : 0;
}

inline void exchange(double* a, double* b, std::size_t n) {
  for_each_vector(0, n, [&]<class Name>(std::size_t j) {
    using V = typename Name::Vector;
    const V t = *(const V*)(a + j);
    *(V*)(a + j) = *(const V*)(b + j);
    *(V*)(b + j) = t;
  });
}

// The panel of P L U that begins at row and column p, with `count` columns. Columns to its right change only
// by exchanges of rows. Its columns are processed one after the other, so that loops run along them.
struct Panel {
  std::size_t m, stride, p, count;
};
bool factor_panel(double* A, std::size_t* pivots, Panel panel, double* columns) {
  const auto [m, stride, p, count] = panel;
  const std::size_t n = m - p;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < count; ++c) columns[n * c + i] = A[stride * (p + i) + p + c];
  for (std::size_t k = 0; k < count; ++k) {
    double* __restrict own = columns + n * k;
    const std::size_t best = k + largest_of(own + k, n - k);
    pivots[p + k] = p + best;
    if (best != k) {
      exchange(A + stride * (p + k), A + stride * (p + best), m);
      for (std::size_t c = 0; c < count; ++c) {
        const double t = columns[n * c + k];
        columns[n * c + k] = columns[n * c + best];
        columns[n * c + best] = t;
      }
    }
    if (!(size(own[k]) > 0)) return false;
    const double inverse = 1 / own[k];
    for_each_vector(k + 1, n, [&]<class Name>(std::size_t i) {
      using V = typename Name::Vector;
      *(V*)(own + i) *= inverse;
    });
    for (std::size_t c = k + 1; c < count; ++c)
      subtract_scaled(columns + n * c + k + 1, own + k + 1, columns[n * c + k], n - k - 1);
  }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < count; ++c) A[stride * (p + i) + p + c] = columns[n * c + i];
  return true;
}

// To the right of the panel: rows x vectors registers of entries -= L (rows x panel_columns) U (panel_columns
// x the rest).
template <int rows, int vectors>
inline void subtract_products_at(double* A, std::size_t stride, std::size_t i, std::size_t p, std::size_t j) {
  const double *L = A + stride * i + p, *U = A + stride * p;
  LooseVec t[rows][vectors];
  for (int r = 0; r < rows; ++r)
    for (int v = 0; v < vectors; ++v) t[r][v] = *(const LooseVec*)(A + stride * (i + r) + j + v * width);
  for (std::size_t k = 0; k < panel_columns; ++k) {
    LooseVec u[vectors];
    for (int v = 0; v < vectors; ++v) u[v] = *(const LooseVec*)(U + stride * k + j + v * width);
    for (int r = 0; r < rows; ++r)
      for (int v = 0; v < vectors; ++v) t[r][v] -= L[stride * r + k] * u[v];
  }
  for (int r = 0; r < rows; ++r)
    for (int v = 0; v < vectors; ++v) *(LooseVec*)(A + stride * (i + r) + j + v * width) = t[r][v];
}

// T = S Y of a block of d <= most rows.
template <int most>
inline void multiply_block(double* T, const double* S, const double* Y, std::size_t d, std::size_t n) {
  if constexpr (most > 1)
    if (d < most) return multiply_block<most - 1>(T, S, Y, d, n);
  for (std::size_t j = 0; j < n; j += width) {
    LooseVec y[most];
    for (int k = 0; k < most; ++k) y[k] = *(const LooseVec*)(Y + n * k + j);
    for (int i = 0; i < most; ++i) {
      LooseVec t = {};
      for (int k = 0; k < most; ++k) t += S[most * i + k] * y[k];
      *(LooseVec*)(T + n * i + j) = t;
    }
  }
}

template <int rows>
inline void subtract_products(double* A, std::size_t stride, std::size_t i, std::size_t p) {
  std::size_t j = p + panel_columns;
  for (; j + 2 * width <= stride; j += 2 * width) subtract_products_at<rows, 2>(A, stride, i, p, j);
  for (; j < stride; j += width) subtract_products_at<rows, 1>(A, stride, i, p, j);
}

}  // namespace

void add_six_rows(double* to, const double* f, const double* from, std::size_t stride, std::size_t n) {
  add_rows(to, f, from, stride, n);
}

void subtract_six_rows(double* to, std::size_t stride, const double* U, double s, const double* w,
                       std::size_t n) {
  for (int i = 0; i < 6; ++i) {
    double f[6];
    for (int k = 0; k < 6; ++k) f[k] = -s * U[6 * k + i];
    add_rows(to + i * stride, f, w, n, n);
  }
}

// s A = L D L' by rows; then Q = L D^1/2. The roots are taken together at the end.
bool factor_six(double* A, double s, const double* least) {
  Six rows[6];
  for (int i = 0; i < 6; ++i) rows[i].add(s, A + 6 * i);
  double d[6];
#pragma GCC unroll 6
  for (int j = 0; j < 6; ++j) {
    d[j] = rows[j][j] < least[j] ? least[j] : rows[j][j];
    if (!(d[j] > 0)) return false;
    const double w = 1 / d[j];
#pragma GCC unroll 6
    for (int i = j + 1; i < 6; ++i) rows[i].subtract(w * rows[j][i], rows[j]);
  }
  for (int i = 0; i < 6; ++i) {
    A[7 * i] = 1 / __builtin_sqrt(d[i]);
    for (int k = 0; k < i; ++k) A[6 * i + k] = -A[7 * i] * A[7 * k] * rows[k][i];
  }
  return true;
}

// All Q^-1 B come first, because pairs read two of them. Targets follow the upper half by rows, including the
// diagonal.
void eliminate_six(const double* R, double* own, std::size_t count, double s, PairTargets to) {
  for (std::size_t a = 0; R && a < count; ++a) divide_lower(R, own + 36 * a);
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t c = a; c < count; ++c) {
      const std::ptrdiff_t t = *to.next++;
      subtract_product(own + 36 * a, own + 36 * c, s,
                       t < 0 ? to.diagonal + 36 * (-1 - t) : to.blocks + 36 * t);
    }
}

void divide_six_rows(const double* R, double* rows, std::size_t n) {
  for (int i = 0; i < 6; ++i) {
    double* __restrict row = rows + i * n;
    const double* r = R + 6 * i;
    for_each_vector(0, n, [&]<class Name>(std::size_t j) {
      using V = typename Name::Vector;
      V t = r[i] * *(const V*)(row + j);
      for (int k = 0; k < i; ++k) t += r[k] * *(const V*)(rows + k * n + j);
      *(V*)(row + j) = t;
    });
  }
}

// The upper half only: column i of Y with columns i to n. Rows of Y have entries where bodies lie beyond
// their coordinates: other columns are passed over.
void add_gram(double* W, std::size_t m, const double* Y, std::size_t stride, std::size_t n, double s) {
  for (std::size_t i = 0; i < n; ++i) {
    double f[6];
    bool zero = true;
    for (int k = 0; k < 6; ++k) {
      f[k] = s * Y[k * stride + i];
      zero = zero && f[k] == 0;
    }
    if (!zero) add_rows(W + m * i + i, f, Y + i, stride, n - i);
  }
}

void add_product(double* y, const double* x, const double* A, std::size_t rows, std::size_t n) {
  std::size_t i = 0;
  for (; i + 6 <= rows; i += 6) add_rows(y, x + i, A + n * i, n, n);
  for (; i < rows; ++i) subtract_scaled(y, A + n * i, -x[i], n);
}

// Sums over eight lanes: the bits do not depend on the width of registers.
void add_row_products(double* y, const double* A, const double* z, std::size_t rows, std::size_t n) {
  for (std::size_t i = 0; i < rows; ++i) y[i] += product_of_rows(A + n * i, z, n);
}

// The number of rows is known to the compiler: all of S and of a column of Y stays in registers.
void multiply_rows(double* T, const double* S, const double* Y, std::size_t d, std::size_t n) {
  multiply_block<6>(T, S, Y, d, n);
}

// Rows of Y are zero off the way from their bodies to the root, and so are whole columns of L. The six rows
// of T are read again for each column that is left: they are short, and stay in the first cache.
void add_outer(double* N, const double* L, const double* T, std::size_t count, std::size_t stride) {
  for (std::size_t i = 0; i < count; ++i) {
    double f[6];
    bool zero = true;
    for (int k = 0; k < 6; ++k) {
      f[k] = L[k * stride + i];
      zero = zero && f[k] == 0;
    }
    if (!zero) add_rows(N + stride * i, f, T, stride, stride);
  }
}

// Row pivots only: rows of (G + H W) differ in scale by the laws of their blocks, columns do not.
bool factor_rows(double* A, std::size_t* pivots, std::size_t m, std::size_t stride, double* columns) {
  for (std::size_t p = 0; p < m; p += panel_columns) {
    const std::size_t end = p + panel_columns;
    if (!factor_panel(A, pivots, {m, stride, p, end < m ? panel_columns : m - p}, columns)) return false;
    if (end >= m) break;
    // Rows of U in these columns, and their contribution to all rows below.
    for (std::size_t k = p + 1; k < end; ++k)
      for (std::size_t r = p; r < k; ++r)
        subtract_scaled(A + stride * k + end, A + stride * r + end, A[stride * k + r], stride - end);
    std::size_t i = end;
    for (; i + 4 <= m; i += 4) subtract_products<4>(A, stride, i, p);
    for (; i < m; ++i) subtract_products<1>(A, stride, i, p);
  }
  return true;
}

// The last test is also false for infinities.
bool solve_rows(const double* A, const std::size_t* pivots, double* b, std::size_t m, std::size_t stride) {
  for (std::size_t k = 0; k < m; ++k) {
    const double t = b[pivots[k]];
    b[pivots[k]] = b[k];
    b[k] = t;
  }
  for (std::size_t i = 0; i < m; ++i) b[i] -= product_of_rows(A + stride * i, b, i);
  for (std::size_t k = m; k-- > 0;) {
    b[k] = (b[k] - product_of_rows(A + stride * k + k + 1, b + k + 1, m - k - 1)) / A[stride * k + k];
    if (!(b[k] - b[k] == 0)) return false;
  }
  return true;
}

}  // namespace amontons::AMONTONS_ISA
