// Eight-lane loops over the rows of a body-space system; see body_kernel.hpp.
#include "body_kernel.hpp"

namespace amontons::AMONTONS_ISA {

namespace {
typedef double V8 __attribute__((vector_size(64), aligned(8), may_alias));
}

void scatter_rows(const BodyRows& rows, const double* z, double* nodes) {
  for (std::size_t i = 0; i < rows.rows; ++i) {
    const double* g = rows.G + 16 * i;
    V8* a = (V8*)(nodes + 8 * (std::size_t)rows.node_a[i]);
    *a += z[i] * *(const V8*)g;
    V8* b = (V8*)(nodes + 8 * (std::size_t)rows.node_b[i]);
    *b += z[i] * *(const V8*)(g + 8);
  }
}

void gather_rows(const BodyRows& rows, const double* nodes, double* out) {
  for (std::size_t i = 0; i < rows.rows; ++i) {
    const double* g = rows.G + 16 * i;
    const V8 p = *(const V8*)g * *(const V8*)(nodes + 8 * (std::size_t)rows.node_a[i]) +
                 *(const V8*)(g + 8) * *(const V8*)(nodes + 8 * (std::size_t)rows.node_b[i]);
    out[i] = ((p[0] + p[1]) + (p[2] + p[3])) + (p[4] + p[5]);
  }
}

void combine_rows(const double* R, int dim, const double* D, double* G) {
  for (int i = 0; i < dim; ++i) {
    V8 a = {}, b = {};
    for (int j = 0; j < dim; ++j) {
      a += R[j * dim + i] * *(const V8*)(D + 16 * j);
      b += R[j * dim + i] * *(const V8*)(D + 16 * j + 8);
    }
    *(V8*)(G + 16 * i) = a;
    *(V8*)(G + 16 * i + 8) = b;
  }
}

void add_outer_product(double* H, int stride, const double* left, const double* right, int dim) {
  for (int c = 0; c < 6; ++c) {
    V8 column = *(const V8*)(H + (long)c * stride);
    for (int i = 0; i < dim; ++i) column += *(const V8*)(left + 16 * i) * right[16 * i + c];
    *(V8*)(H + (long)c * stride) = column;
  }
}

}  // namespace amontons::AMONTONS_ISA
