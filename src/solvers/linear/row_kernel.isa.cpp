// A kernel (base/isa.hpp): compiled once per instruction set, without inline functions of the standard
// library. Six rows at a time, because blocks are 6 x 6: one load and store of the target for six products.
#include "solvers/linear/row_kernel.hpp"

#include "amontons/base/native_vector.hpp"

namespace amontons::AMONTONS_ISA {

namespace {

// The terms of an entry are added in the order of the rows, in vectors as in the rest: the same bits.
inline void add_rows(double* __restrict to, const double* f, const double* __restrict from,
                     std::size_t stride, std::size_t n) {
  const double *r0 = from, *r1 = r0 + stride, *r2 = r1 + stride, *r3 = r2 + stride, *r4 = r3 + stride,
               *r5 = r4 + stride;
  std::size_t j = 0;
  for (; j + width <= n; j += width) {
    LooseVec t = *(const LooseVec*)(to + j);
    t += f[0] * *(const LooseVec*)(r0 + j);
    t += f[1] * *(const LooseVec*)(r1 + j);
    t += f[2] * *(const LooseVec*)(r2 + j);
    t += f[3] * *(const LooseVec*)(r3 + j);
    t += f[4] * *(const LooseVec*)(r4 + j);
    t += f[5] * *(const LooseVec*)(r5 + j);
    *(LooseVec*)(to + j) = t;
  }
  for (; j < n; ++j) {
    double t = to[j];
    t += f[0] * r0[j];
    t += f[1] * r1[j];
    t += f[2] * r2[j];
    t += f[3] * r3[j];
    t += f[4] * r4[j];
    t += f[5] * r5[j];
    to[j] = t;
  }
}

inline void subtract_scaled(double* __restrict y, const double* __restrict x, double a, std::size_t n) {
  std::size_t i = 0;
  for (; i + width <= n; i += width) *(LooseVec*)(y + i) -= a * *(const LooseVec*)(x + i);
  for (; i < n; ++i) y[i] -= a * x[i];
}

using Two __attribute__((vector_size(16), aligned(8), may_alias)) = double;
// A row of six numbers in registers: four and two, or three times two. What is done to each number is the
// same, only how many an instruction holds differs.
#if defined(__AVX2__)
using Four __attribute__((vector_size(32), aligned(8), may_alias)) = double;
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

// B := X B with lower triangular X; from the last row up, so that what is read is still there.
inline void multiply_lower(const double* X, double* B) {
  for (int i = 5; i >= 0; --i) {
    Six row;
    for (int k = 0; k <= i; ++k) row.add(X[6 * i + k], B + 6 * k);
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

// Columns that are factored before the rest of the matrix is seen again.
constexpr std::size_t panel_columns = 8;

// Columns [p, end) of P L U, which change no column to the right but by exchanges of rows.
bool factor_columns(double* A, std::size_t* pivots, std::size_t m, std::size_t p, std::size_t end) {
  for (std::size_t k = p; k < end; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < m; ++i)
      if (size(A[m * i + k]) > size(A[m * best + k])) best = i;
    pivots[k] = best;
    double* pivot = A + m * k;
    if (best != k) {
      double* other = A + m * best;
      for (std::size_t j = 0; j < m; ++j) {
        const double t = pivot[j];
        pivot[j] = other[j];
        other[j] = t;
      }
    }
    if (!(size(pivot[k]) > 0)) return false;
    const double inverse = 1 / pivot[k];
    for (std::size_t i = k + 1; i < m; ++i) {
      double* row = A + m * i;
      if (row[k] == 0) continue;
      row[k] *= inverse;
      for (std::size_t j = k + 1; j < end; ++j) row[j] -= row[k] * pivot[j];
    }
  }
  return true;
}

// Right of the columns from p on: some rows from i on -= L (rows x panel_columns) U (panel_columns x the
// rest), in registers.
template <int rows>
inline void subtract_products(double* A, std::size_t m, std::size_t i, std::size_t p) {
  const double *L = A + m * i + p, *U = A + m * p;
  std::size_t j = p + panel_columns;
  for (; j + width <= m; j += width) {
    LooseVec t[rows];
    for (int r = 0; r < rows; ++r) t[r] = *(const LooseVec*)(A + m * (i + r) + j);
    for (std::size_t k = 0; k < panel_columns; ++k) {
      const LooseVec u = *(const LooseVec*)(U + m * k + j);
      for (int r = 0; r < rows; ++r) t[r] -= L[m * r + k] * u;
    }
    for (int r = 0; r < rows; ++r) *(LooseVec*)(A + m * (i + r) + j) = t[r];
  }
  for (; j < m; ++j)
    for (int r = 0; r < rows; ++r)
      for (std::size_t k = 0; k < panel_columns; ++k) A[m * (i + r) + j] -= L[m * r + k] * U[m * k + j];
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

// s A = L D L' by rows, which make L^-1 of the unit matrix on their way; then R^-1 = D^-1/2 L^-1. A pivot
// waits for one division, and the roots come at the end, side by side.
bool invert_root_six(double* A, double s) {
  constexpr double unit[36] = {1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0,
                               0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1};
  Six rows[6], inverse[6];
  for (int i = 0; i < 6; ++i) {
    rows[i].add(s, A + 6 * i);
    inverse[i].add(1, unit + 6 * i);
  }
  double d[6];
#pragma GCC unroll 6
  for (int j = 0; j < 6; ++j) {
    d[j] = rows[j][j];
    if (!(d[j] > 0)) return false;
    const double w = 1 / d[j];
#pragma GCC unroll 6
    for (int i = j + 1; i < 6; ++i) {
      const double f = w * rows[j][i];
      rows[i].subtract(f, rows[j]);
      inverse[i].subtract(f, inverse[j]);
    }
  }
  for (int i = 0; i < 6; ++i) {
    Six row;
    row.subtract(-1 / __builtin_sqrt(d[i]), inverse[i]);
    row.store(A + 6 * i);
  }
  return true;
}

// All X B first: pairs read two of them. targets go through the upper half by rows, a with itself included.
void eliminate_six(const double* X, double* own, std::size_t count, double s, const std::ptrdiff_t* target,
                   double* diagonal, double* blocks) {
  for (std::size_t a = 0; a < count; ++a) multiply_lower(X, own + 36 * a);
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t c = a; c < count; ++c) {
      const std::ptrdiff_t t = *target++;
      subtract_product(own + 36 * a, own + 36 * c, s, t < 0 ? diagonal + 36 * (-1 - t) : blocks + 36 * t);
    }
}

// From the last row up, as multiply_lower.
void multiply_six_rows(const double* X, double* rows, std::size_t n) {
  for (int i = 5; i >= 0; --i) {
    double* __restrict row = rows + i * n;
    const double* x = X + 6 * i;
    std::size_t j = 0;
    for (; j + width <= n; j += width) {
      LooseVec t = x[i] * *(const LooseVec*)(row + j);
      for (int k = 0; k < i; ++k) t += x[k] * *(const LooseVec*)(rows + k * n + j);
      *(LooseVec*)(row + j) = t;
    }
    for (; j < n; ++j) {
      double t = x[i] * row[j];
      for (int k = 0; k < i; ++k) t += x[k] * rows[k * n + j];
      row[j] = t;
    }
  }
}

// From the diagonal on: column i of Y with those from i to n.
void add_gram(double* W, std::size_t m, const double* Y, std::size_t stride, std::size_t n, double s) {
  for (std::size_t i = 0; i < n; ++i) {
    double f[6];
    for (int k = 0; k < 6; ++k) f[k] = s * Y[k * stride + i];
    add_rows(W + m * i + i, f, Y + i, stride, n - i);
  }
}

void add_product(double* y, const double* x, const double* A, std::size_t m) {
  std::size_t i = 0;
  for (; i + 6 <= m; i += 6) add_rows(y, x + i, A + m * i, m, m);
  for (; i < m; ++i) subtract_scaled(y, A + m * i, -x[i], m);
}

// Row pivots alone: rows of (G + H W) differ in scale by the laws of their blocks, columns do not.
bool factor_rows(double* A, std::size_t* pivots, std::size_t m) {
  for (std::size_t p = 0; p < m; p += panel_columns) {
    const std::size_t end = p + panel_columns < m ? p + panel_columns : m;
    if (!factor_columns(A, pivots, m, p, end)) return false;
    // The rows of U of these columns, and what they take from all rows below.
    for (std::size_t k = p + 1; k < end; ++k)
      for (std::size_t r = p; r < k; ++r)
        subtract_scaled(A + m * k + end, A + m * r + end, A[m * k + r], m - end);
    std::size_t i = end;
    for (; i + 4 <= m && end - p == panel_columns; i += 4) subtract_products<4>(A, m, i, p);
    for (; i < m; ++i)
      for (std::size_t r = p; r < end; ++r)
        subtract_scaled(A + m * i + end, A + m * r + end, A[m * i + r], m - end);
  }
  return true;
}

// The last test is false for infinities, too.
bool solve_rows(const double* A, const std::size_t* pivots, double* b, std::size_t m) {
  for (std::size_t k = 0; k < m; ++k) {
    const double t = b[pivots[k]];
    b[pivots[k]] = b[k];
    b[k] = t;
  }
  for (std::size_t i = 0; i < m; ++i) b[i] -= product_of_rows(A + m * i, b, i);
  for (std::size_t k = m; k-- > 0;) {
    b[k] = (b[k] - product_of_rows(A + m * k + k + 1, b + k + 1, m - k - 1)) / A[m * k + k];
    if (!(b[k] - b[k] == 0)) return false;
  }
  return true;
}

}  // namespace amontons::AMONTONS_ISA
