// The dual certificate of a convex quadratic programme (Banjac, Goulart, Stellato, Boyd, "Infeasibility
// detection in the alternating direction method of multipliers for convex optimization", JOTA 2019). It
// serves a cone or a set with an unbounded direction. The driver supplies the candidates d: the growing
// impulses, or their last change.
#include "amontons/problem/infeasibility.hpp"

#include <cmath>

namespace amontons {

namespace {

template <class S>
// The projection on the recession cone of one set: the directions in which it is unbounded. For a cone it is
// the cone itself.
void project_recession(const S& set, const double* d, double* out) {
  if constexpr (S::is_cone)
    set.project(d, out);
  else
    set.project_recession(d, out);
}

}  // namespace

// The conditions without cost come first; the product is only formed for a d that satisfies them. All
// conditions are relative to the length of d in the metric of P, so that neither the length of d nor units
// matter. The limit -1e-3 keeps <b, d> far from the rounding of its sum. Norms in the P metric: impulses d by
// P, velocities b and A d by P^-1.
bool proves_infeasible(const Problem& problem, Law law, std::span<const double> d, double tolerance) {
  if (law == Law::coulomb && problem.K.contacts() > 0) return false;
  const std::size_t m = problem.rows();
  double d2 = 0, b2 = 0, outside = 0, bd = 0;
  // d2 = |d|_P^2, b2 = |b|^2 by P^-1, bd = <b, d>, outside = the squared distance of d to the recession
  // cone.
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double foot[S::dim];
    project_recession(set, &d[row], foot);
    for (int k = 0; k < S::dim; ++k) {
      const double v = d[row + k], b = problem.b[row + k], p = problem.P[block];
      d2 += p * v * v;
      b2 += b * b / p;
      bd += b * v;
      outside += p * (v - foot[k]) * (v - foot[k]);
    }
  });
  const double norm = std::sqrt(d2);
  if (!(norm > 0) || !std::isfinite(norm) || bd > -1e-3 * norm * std::sqrt(b2) ||
      std::sqrt(outside) > tolerance * norm)
    return false;
  // A d = 0, for the direction of length 1.
  std::vector<double> unit(m), image(m);
  for (std::size_t i = 0; i < m; ++i) unit[i] = d[i] / norm;
  product(problem.A, unit, image);
  double image2 = 0;
  for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int k = 0; k < S::dim; ++k) image2 += image[row + k] * image[row + k] / problem.P[block];
  });
  return std::sqrt(image2) <= tolerance;
}

}  // namespace amontons
