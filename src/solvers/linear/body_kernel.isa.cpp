// Eight-lane loops over the rows of a body-space system; see body_kernel.hpp.
#include "solvers/linear/body_kernel.hpp"

#include "amontons/base/native_vector.hpp"

namespace amontons::AMONTONS_ISA {

// nodes += z_i G_i, whole registers with their zeros. An earlier row may have changed the nodes that a row
// loads, so the order of the rows is the order of the sums.
void scatter_rows(const NodeRows& rows, const double* z, double* nodes) {
  const int* node = rows.node;
  const double* g = rows.G;
  for (std::size_t b = 0; b < rows.blocks; node += rows.nodes[b], ++b)
    for (int i = 0; i < rows.rows[b]; ++i, ++z)
      for (int s = 0; s < rows.nodes[b]; ++s, g += 8) {
        double* to = nodes + 8 * (std::size_t)node[s];
        for (int q = 0; q < 8; q += width) *(LooseVec*)(to + q) += *z * *(const LooseVec*)(g + q);
      }
}

// Inner products of at most six terms per node: eight lanes are formed, and the six used ones added in one
// order.
void gather_rows(const NodeRows& rows, const double* nodes, double* out) {
  const int* node = rows.node;
  const double* g = rows.G;
  for (std::size_t b = 0; b < rows.blocks; node += rows.nodes[b], ++b)
    for (int i = 0; i < rows.rows[b]; ++i) {
      LooseVec p[8 / width] = {};
      for (int s = 0; s < rows.nodes[b]; ++s, g += 8) {
        const double* from = nodes + 8 * (std::size_t)node[s];
        for (int q = 0; q < 8 / width; ++q)
          p[q] += *(const LooseVec*)(g + width * q) * *(const LooseVec*)(from + width * q);
      }
      const auto lane = [&](int k) { return p[k / width][k % width]; };
      *out++ = ((lane(0) + lane(1)) + (lane(2) + lane(3))) + (lane(4) + lane(5));
    }
}

// G_i = sum_j R_ji D_j: rows of R' D, eight columns at a time.
void combine_rows(const double* R, int dim, const double* D, double* G, int lanes) {
  for (int i = 0; i < dim; ++i)
    for (int q = 0; q < lanes; q += width) {
      LooseVec sum = {};
      for (int j = 0; j < dim; ++j) sum += R[j * dim + i] * *(const LooseVec*)(D + lanes * j + q);
      *(LooseVec*)(G + lanes * i + q) = sum;
    }
}

// H_qc += sum_i left_iq right_ic for q = 0 .. 7: the last ones of left are padding zeros, so that whole
// registers serve any node.
void add_outer_product(EightRows H, const double* left, const double* right, int lanes, int dim) {
  for (int c = 0; c < H.columns; ++c)
    for (int q = 0; q < 8; q += width) {
      double* to = H.at + (std::ptrdiff_t)c * H.stride + q;
      LooseVec column = *(const LooseVec*)to;
      for (int i = 0; i < dim; ++i) column += *(const LooseVec*)(left + lanes * i + q) * right[lanes * i + c];
      *(LooseVec*)to = column;
    }
}

}  // namespace amontons::AMONTONS_ISA
