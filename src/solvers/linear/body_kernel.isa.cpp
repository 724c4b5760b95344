// Eight-lane loops over the rows of a body-space system; see body_kernel.hpp.
#include "solvers/linear/body_kernel.hpp"

#include "amontons/base/native_vector.hpp"

namespace amontons::AMONTONS_ISA {

// nodes_a += z_i G_ia and nodes_b += z_i G_ib, whole registers with their zeros. An earlier row may have
// changed the nodes that a row loads, so the order of the rows is the order of the sums.
void scatter_rows(const BodyRows& rows, const double* z, double* nodes) {
  for (std::size_t i = 0; i < rows.rows; ++i) {
    const double* g = rows.G + 16 * i;
    double* a = nodes + 8 * (std::size_t)rows.node_a[i];
    double* b = nodes + 8 * (std::size_t)rows.node_b[i];
    for (int q = 0; q < 8; q += width) *(LooseVec*)(a + q) += z[i] * *(const LooseVec*)(g + q);
    for (int q = 0; q < 8; q += width) *(LooseVec*)(b + q) += z[i] * *(const LooseVec*)(g + 8 + q);
  }
}

// Inner products of six terms each: eight lanes are formed, and the six used ones added in one order.
void gather_rows(const BodyRows& rows, const double* nodes, double* out) {
  for (std::size_t i = 0; i < rows.rows; ++i) {
    const double* g = rows.G + 16 * i;
    const double* a = nodes + 8 * (std::size_t)rows.node_a[i];
    const double* b = nodes + 8 * (std::size_t)rows.node_b[i];
    LooseVec p[8 / width];
    for (int q = 0; q < 8 / width; ++q)
      p[q] = *(const LooseVec*)(g + width * q) * *(const LooseVec*)(a + width * q) +
             *(const LooseVec*)(g + 8 + width * q) * *(const LooseVec*)(b + width * q);
    const auto lane = [&](int k) { return p[k / width][k % width]; };
    out[i] = ((lane(0) + lane(1)) + (lane(2) + lane(3))) + (lane(4) + lane(5));
  }
}

// G_i = sum_j R_ji D_j: rows of R' D, sixteen columns at a time.
void combine_rows(const double* R, int dim, const double* D, double* G) {
  for (int i = 0; i < dim; ++i)
    for (int q = 0; q < 16; q += width) {
      LooseVec sum = {};
      for (int j = 0; j < dim; ++j) sum += R[j * dim + i] * *(const LooseVec*)(D + 16 * j + q);
      *(LooseVec*)(G + 16 * i + q) = sum;
    }
}

// H_qc += sum_i left_iq right_ic for q = 0 .. 7: the last two of left are padding zeros, so that whole
// registers serve six rows.
void add_outer_product(double* H, int stride, const double* left, const double* right, int dim) {
  for (int c = 0; c < 6; ++c)
    for (int q = 0; q < 8; q += width) {
      double* to = H + (std::ptrdiff_t)c * stride + q;
      LooseVec column = *(const LooseVec*)to;
      for (int i = 0; i < dim; ++i) column += *(const LooseVec*)(left + 16 * i + q) * right[16 * i + c];
      *(LooseVec*)to = column;
    }
}

}  // namespace amontons::AMONTONS_ISA
