#pragma once
#include "amontons/base/isa.hpp"

namespace amontons {

// Factors the first `columns` columns of the lower triangle of a dense symmetric front x front matrix
// (column-major, leading dimension `stride`) and subtracts their outer product from the rest. Entries above
// the diagonal are read and overwritten, but never used. `pack` is scratch of front_pack_size(front) doubles.
// Returns the number of non-positive pivots that were replaced by a huge one.
AMONTONS_FOR_EACH_ISA(int partial_cholesky(double* front_matrix, int front, int stride, int columns,
                                           double* pack);)
// The same for L U of an unsymmetric matrix, without exchanges of rows. `lower` holds its lower triangle,
// `upper` its transposed upper one, both the diagonal. A pivot of zero is replaced.
AMONTONS_FOR_EACH_ISA(int partial_lu(double* lower, double* upper, int front, int stride, int columns,
                                     double* pack);)

// The two triangular solves with one panel L (front x columns, column-major, no padding). Forward: own :=
// L11^-1 own, below := L21 own. Backward: own := L11^-T (own - L21' below).
AMONTONS_FOR_EACH_ISA(void panel_forward(const double* L, int front, int columns, double* own, double* below);
                      void panel_backward(const double* L, int front, int columns, double* own,
                                          const double* below);)

// Columns per panel: narrow, because factoring a panel runs slower than subtracting it. 12 times 16 rows of L
// are 1.5 kB and stay in the L1 cache for all columns to the right.
constexpr int front_panel = 12;
// Doubles of the packed transpose of a panel; strips of four columns round its length up.
constexpr int front_pack_size(int front) { return front_panel * (front + 8); }

}  // namespace amontons
