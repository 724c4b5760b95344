// The dense kernel of the multifrontal factorisation. Right-looking by panels of columns: factor a panel,
// then subtract its part of L L' from the columns right of it in register tiles of 16 x 4,
//  | A11      |       L11 L11' = A11,  L21 = A21 L11^-T     the panel
//  | A21  A22 |       A22 := A22 - L21 L21'                 the rest, where nearly all work is
// Only lower triangles are used; tiles on the diagonal compute some entries above it, which nothing reads.
// The terms of an entry are subtracted in the order of the columns for every tile, so that all widths give
// the same bits.
#include "solvers/linear/front_kernel.hpp"

#include <cstddef>

#include "amontons/base/native_vector.hpp"

namespace amontons::AMONTONS_ISA {

namespace {

// y[0..n) -= a x[0..n)
inline void subtract_scaled(double* __restrict y, const double* __restrict x, double a, int n) {
  int i = 0;
  for (; i + width <= n; i += width) *(LooseVec*)(y + i) -= a * *(const LooseVec*)(x + i);
  for (; i < n; ++i) y[i] -= a * x[i];
}

// Columns [p, end) of a matrix of n rows, whose columns are `stride` numbers apart.
struct Panel {
  int n, stride, p, end;
};

// A panel in the rows [p, n), left-looking inside the panel. The earlier columns of the panel are
// subtracted from column j, which is then divided by the root of its pivot. A pivot that is not positive
// (rounding in a semidefinite matrix) becomes 1e100: its column nearly vanishes, and with it the part of a
// solution along it.
int factor_panel(double* A, Panel panel) {
  const auto [n, stride, p, end] = panel;
  int replaced = 0;
  for (int j = p; j < end; ++j) {
    double* column = A + (std::ptrdiff_t)j * stride;
    for (int k = p; k < j; ++k)
      subtract_scaled(column + j, A + (std::ptrdiff_t)k * stride + j, A[(std::ptrdiff_t)k * stride + j],
                      n - j);
    double pivot = column[j];
    if (!(pivot > 0)) {
      pivot = 1e100;
      ++replaced;
    }
    const double root = __builtin_sqrt(pivot), scale = 1 / root;
    column[j] = root;
    for (int i = j + 1; i < n; ++i) column[i] *= scale;
  }
  return replaced;
}

// The same for an unsymmetric matrix, with its lower triangle in A and its transposed upper one in B: A = L,
// B = U'. Both are divided by the root of the pivot's size; U takes its sign.
int factor_both_panels(double* A, double* B, Panel panel) {
  const auto [n, stride, p, end] = panel;
  int replaced = 0;
  for (int j = p; j < end; ++j) {
    double *l = A + (std::ptrdiff_t)j * stride, *u = B + (std::ptrdiff_t)j * stride;
    for (int k = p; k < j; ++k) {
      const double *lk = A + (std::ptrdiff_t)k * stride + j, *uk = B + (std::ptrdiff_t)k * stride + j;
      subtract_scaled(l + j, lk, uk[0], n - j);
      subtract_scaled(u + j, uk, lk[0], n - j);
    }
    const double pivot = l[j], size = pivot < 0 ? -pivot : pivot;
    if (!(size > 0)) ++replaced;
    const double root = __builtin_sqrt(size > 0 ? size : 1e100);
    l[j] = root;
    u[j] = pivot < 0 ? -root : root;
    const double of_l = 1 / u[j], of_u = 1 / root;
    for (int i = j + 1; i < n; ++i) {
      l[i] *= of_l;
      u[i] *= of_u;
    }
  }
  return replaced;
}

// C (rows x 4 columns) -= L (rows x depth, column-major) B (depth x 4, packed row by row), in tiles of at
// most two registers by four columns. The 8 accumulators leave room for L and B among 16 registers, and each
// loaded value of L serves four columns.
template <int rows>
inline void tile(double* C, int stride, const double* L, const double* B, int depth) {
  constexpr int registers = rows > width ? 2 : 1, step = registers * width;
  for (int r = 0; r < rows; r += step) {
    LooseVec c[4][registers];
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < registers; ++i)
        c[j][i] = *(const LooseVec*)(C + (std::ptrdiff_t)j * stride + r + i * width);
    const double *l = L + r, *b = B;
    for (int k = 0; k < depth; ++k, l += stride, b += 4)
      for (int i = 0; i < registers; ++i) {
        const LooseVec column = *(const LooseVec*)(l + i * width);
        for (int j = 0; j < 4; ++j) c[j][i] -= column * b[j];
      }
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < registers; ++i)
        *(LooseVec*)(C + (std::ptrdiff_t)j * stride + r + i * width) = c[j][i];
  }
}

// The same at the ends of the matrix, for incomplete tiles.
struct Size {
  int rows, columns, depth;
};
inline void tile_small(double* C, int stride, const double* L, const double* B, Size size) {
  for (int j = 0; j < size.columns; ++j)
    for (int i = 0; i < size.rows; ++i) {
      double sum = C[(std::ptrdiff_t)j * stride + i];
      for (int k = 0; k < size.depth; ++k) sum -= L[(std::ptrdiff_t)k * stride + i] * B[4 * k + j];
      C[(std::ptrdiff_t)j * stride + i] = sum;
    }
}

// A (i, j) -= sum over the columns k of the panel of A (i, k) B (j, k), for i >= j >= end.
void subtract_panel(double* A, const double* B, Panel panel, double* pack) {
  const auto [front, stride, p, end] = panel;
  const int depth = end - p;
  // Rows [end, front) of the panel of B, transposed into strips of 4 columns: a tile reads its factor as one
  // stream, in order.
  for (int j = end; j < front; j += 4) {
    double* strip = pack + (std::ptrdiff_t)(j - end) * front_panel;
    for (int k = 0; k < depth; ++k)
      for (int q = 0; q < 4; ++q)
        strip[4 * k + q] = j + q < front ? B[(std::ptrdiff_t)(p + k) * stride + j + q] : 0.0;
  }
  const double* L = A + (std::ptrdiff_t)p * stride;
  // The loop over strips of rows is outside, so that 16 rows of L serve all columns from the L1 cache.
  for (int i = end; i < front; i += 16) {
    const int rows = front - i < 16 ? front - i : 16;
    for (int j = end; j < front && j < i + rows; j += 4) {
      const double* strip = pack + (std::ptrdiff_t)(j - end) * front_panel;
      double* C = A + (std::ptrdiff_t)j * stride + i;
      const int wide = front - j < 4 ? front - j : 4;
      // 16 rows at a time, or 8 if fewer are left; the remainder entry by entry.
      if (wide < 4) {
        tile_small(C, stride, L + i, strip, {rows, wide, depth});
      } else if (rows == 16) {
        tile<16>(C, stride, L + i, strip, depth);
      } else if (rows >= 8) {
        tile<8>(C, stride, L + i, strip, depth);
        tile_small(C + 8, stride, L + i + 8, strip, {rows - 8, 4, depth});
      } else {
        tile_small(C, stride, L + i, strip, {rows, 4, depth});
      }
    }
  }
}

}  // namespace

int partial_cholesky(double* A, int front, int stride, int columns, double* pack) {
  int replaced = 0;
  for (int p = 0; p < columns; p += front_panel) {
    const Panel panel{front, stride, p, p + front_panel < columns ? p + front_panel : columns};
    replaced += factor_panel(A, panel);
    subtract_panel(A, A, panel, pack);
  }
  return replaced;
}

int partial_lu(double* A, double* B, int front, int stride, int columns, double* pack) {
  int replaced = 0;
  for (int p = 0; p < columns; p += front_panel) {
    const Panel panel{front, stride, p, p + front_panel < columns ? p + front_panel : columns};
    replaced += factor_both_panels(A, B, panel);
    subtract_panel(A, B, panel, pack);
    subtract_panel(B, A, panel, pack);
  }
  return replaced;
}

// Column by column: own is solved, and its multiples are subtracted from the rest and summed in below.
void panel_forward(const double* L, int front, int columns, double* own, double* below) {
  const int rest = front - columns;
  for (int i = 0; i < rest; ++i) below[i] = 0;
  for (int j = 0; j < columns; ++j, L += front) {
    own[j] /= L[j];
    subtract_scaled(own + j + 1, L + j + 1, own[j], columns - j - 1);
    subtract_scaled(below, L + columns, -own[j], rest);
  }
}

// Row j of L' is column j of L: an inner product with the known entries, eight sums in a fixed order.
void panel_backward(const double* L, int front, int columns, double* own, const double* below) {
  const int rest = front - columns;
  L += (std::ptrdiff_t)(columns - 1) * front;
  for (int j = columns - 1; j >= 0; --j, L -= front) {
    double lanes[8] = {};
    int i = 0;
    for (; i + 8 <= rest; i += 8)
      for (int q = 0; q < 8; q += width)
        *(LooseVec*)(lanes + q) +=
            *(const LooseVec*)(L + columns + i + q) * *(const LooseVec*)(below + i + q);
    double sum =
        ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) + ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
    for (; i < rest; ++i) sum += L[columns + i] * below[i];
    for (i = j + 1; i < columns; ++i) sum += L[i] * own[i];
    own[j] = (own[j] - sum) / L[j];
  }
}

}  // namespace amontons::AMONTONS_ISA
