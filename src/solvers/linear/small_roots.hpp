#pragma once
#include <array>

// Roots of small matrices of bodies and blocks for the factorisations of ShiftedSystem.
namespace amontons {

// Lower C with C C' = a symmetric positive semidefinite 3 x 3 given as xx, yy, zz, xy, xz, yz, in the same
// order:
//  c00 = sqrt(xx)    c10 = xy / c00    c11 = sqrt(yy - c10^2)
//  c20 = xz / c00    c21 = (yz - c20 c10) / c11    c22 = sqrt(zz - c20^2 - c21^2)
// A pivot below 1e-14 of the trace is rounding of zero (a body that does not turn about some axis). Its
// column is set to zero, because a division by its root would amplify the rounding.
std::array<double, 6> semidefinite_root(const std::array<double, 6>& s);

// j C for a row j of D: linear part times 1/sqrt(m), angular part times the root of the inverse inertia.
// C is lower triangular, so that out_k sums over the rows from k on.
void times_root(const std::array<double, 6>& j, double translation, const std::array<double, 6>& c,
                double* out);
// C v: a velocity from coordinates in which the kinetic energy is |v|^2 / 2. `v` and `out` may be the same.
void root_times(double translation, const std::array<double, 6>& c, const double* v, double* out);

// Lower L with L L' = I + e R'R, row-major dim x dim: Cholesky, with pivots of 1 or more. e is the compliance
// of the first row of the block.
void compliance_root(const double* R, int dim, double e, double* L);

}  // namespace amontons
