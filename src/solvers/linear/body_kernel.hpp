#pragma once
#include <cstddef>

#include "amontons/base/isa.hpp"

namespace amontons {

// The loops of a body-space system over its rows. A row of G is 16 doubles, six for body a at 0 and six for
// body b at 8, zeros elsewhere. A body vector is eight doubles per node, two of them zero. A missing body is
// node `nodes`, an extra one that stays zero, so that no loop has a branch.
struct BodyRows {
  std::size_t rows;
  const int* node_a;
  const int* node_b;
  const double* G;
};

// Rows are processed in their order: rows that share a body must not be reordered.
AMONTONS_FOR_EACH_ISA(
    void scatter_rows(const BodyRows& rows, const double* z, double* nodes);   // nodes += G' z
    void gather_rows(const BodyRows& rows, const double* nodes, double* out);  // out = G nodes
    // dim rows of G = R' D, R row-major dim x dim
    void combine_rows(const double* R, int dim, const double* D, double* G);
    // 6 x 6 block at H (column-major) += sum over `dim` rows of left' right; left and right point
    // into G. Also adds zeros to two entries past each column.
    void add_outer_product(double* H, int stride, const double* left, const double* right, int dim);)

}  // namespace amontons
