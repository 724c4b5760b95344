#pragma once
#include <vector>

#include "amontons/problem/problem.hpp"

namespace amontons {

// The metric of APGD, P in its formulas. P of a problem is one number per block, the mean of diag(A) over its
// rows, so that the projection in it is the Euclidean one. But the effective masses of a contact along its
// normal and its tangents differ; for spheres the ratio is 1 : 3.5. With one number for the normal, p_n, and
// one for both tangents, p_t, a circular cone stays circular, with tangents scaled by sqrt(p_t / p_n). Their
// ratio is the root of that of diag(A), which serves blocks and spheres alike: piles of spheres take fewer
// iterations, walls the same number. Solution and residual do not change. P-SPG-FB keeps P: with two numbers
// it was faster on piles, but did not reach 1e-8 on a stack of six boxes.
struct BlockMetric {
  double aspect;   // sqrt(p_t / p_n); 1 for all but friction cones of three rows
  double tangent;  // p_t (1/kg)
  // The entry of row k of the block.
  double operator[](int k) const { return k == 0 ? tangent / (aspect * aspect) : tangent; }
};

// That of a friction cone of three rows with these entries of diag(A), and with this P.
BlockMetric friction_metric(const double* diagonal, double P);
// The metric of every block.
std::vector<BlockMetric> block_metrics(const Problem& problem);

// Projection on a set: on a friction cone in this metric, on any other set in P.
template <class S>
void project_in(const BlockMetric& metric, const S& set, const double* z, double* out) {
  if constexpr (!std::is_same_v<S, Friction>) {
    set.project(z, out);
  } else {
    const double scaled[3] = {z[0], metric.aspect * z[1], metric.aspect * z[2]};
    Friction{metric.aspect * set.mu}.project(scaled, out);
    for (int k = 1; k < 3; ++k) out[k] /= metric.aspect;
  }
}

}  // namespace amontons
