#pragma once
#include <cstddef>

#include "amontons/base/isa.hpp"

namespace amontons {

// The loops of a body-space system over its rows. A block has some rows, all on the same nodes. A row of G is
// eight doubles per node, zeros beyond the coordinates of the node. So is a vector of the nodes.
struct NodeRows {
  std::size_t blocks;
  const int *rows, *nodes;  // per block, how many
  const int* node;          // one block after the other
  const double* G;          // one row after the other
};

// Columns of eight numbers, `stride` apart.
struct EightRows {
  double* at;
  int stride, columns;
};

// Rows are processed in their order: rows that share a node must not be reordered.
AMONTONS_FOR_EACH_ISA(
    void scatter_rows(const NodeRows& rows, const double* z, double* nodes);   // nodes += G' z
    void gather_rows(const NodeRows& rows, const double* nodes, double* out);  // out = G nodes
    // dim rows of G = R' D, R row-major dim x dim; rows of D and G have `lanes` numbers, a multiple of eight
    void combine_rows(const double* R, int dim, const double* D, double* G, int lanes);
    // H += sum over `dim` rows of left' right; left and right point into G, whose rows have `lanes` numbers.
    // Only the rows of a node count: those beyond get zeros.
    void add_outer_product(EightRows H, const double* left, const double* right, int lanes, int dim);)

}  // namespace amontons
