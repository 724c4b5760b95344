// Of a block with p, the mean of its diag(A), the natural map has a square of m v^2, m = 1 / p, where v is
// the velocity by which it misses (residual.hpp). The same with U, the velocity that it has without impulses,
// in the place of v is what the block puts into the measure of the whole: below the tolerance of that,
// nothing which becomes of the block is seen.
#include "multibody/step/unseen.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "amontons/problem/residual.hpp"

namespace amontons {

namespace {

// Of the velocity U: what blocks that are not seen may miss by, and what they are asked for then.
constexpr double wrong = 0.05, right = 0.005;
// Of the fastest block: what counts as a velocity at all, as some have none without impulses.
constexpr double slow = 1e-3;
// Of the natural map of the whole: below is rounding.
constexpr double least_tolerance = 1e-14;

// The velocity of a block: of its normal and tangents, whatever turns at them.
template <class S>
double speed(const double* v) {
  double sum = 0;
  for (int k = 0; k < std::min(S::dim, 3); ++k) sum += v[k] * v[k];
  return std::sqrt(sum);
}

// Of a spring or a servo the velocity says nothing: its E is what diag(A) has most of.
bool is_soft(const Problem& problem, std::size_t block, std::size_t row) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contacts = A.contacts.size();
  if (block < contacts) return A.contact_compliance[block] > 0.5 * problem.P[block];
  return A.compliance[row - (problem.rows() - A.jacobian.size())] > 0.5 * problem.P[block];
}

}  // namespace

double tolerance_of_unseen(const Problem& problem, Law law, const Solution& s, double tolerance) {
  const double whole = natural_map_at_zero(problem, law), seen = tolerance * whole;
  double fastest = 0, heaviest = 0, lightest = std::numeric_limits<double>::infinity();
  for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    if (is_soft(problem, block, row)) return;
    fastest = std::max(fastest, speed<S>(&problem.b[row]));
    lightest = std::min(lightest, 1 / problem.P[block]);
    heaviest = std::max(heaviest, 1 / problem.P[block]);
  });
  // Bodies of about one mass: nothing is unseen.
  if (!(lightest < tolerance * heaviest)) return std::numeric_limits<double>::infinity();
  double found = std::numeric_limits<double>::infinity();
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    if (is_soft(problem, block, row)) return;
    const double p = problem.P[block];
    const double U = speed<S>(&problem.b[row]) + slow * fastest;
    // What closes while it slides is in the natural map of a steep cone by 1 / mu only.
    double steep = 1, closing = 0;
    if constexpr (S::frictional) {
      constexpr double slips[6] = {0, 1, 1, 0, 0, 0};
      steep = 1 + set.saxce(slips) * set.saxce(slips);
      closing = set.violation(&s.u[row]);
    }
    if (!(wrong * wrong * U * U < p * steep * seen * seen)) return;
    double g[S::dim];
    add_saxce_term(set, law, &s.u[row], g);
    const double missed = std::max(closing, std::sqrt(natural_map_squared(set, p, &s.x[row], g) * p));
    if (missed > wrong * U) found = std::min(found, right * U / std::sqrt(p * steep));
  });
  return std::max(found / whole, least_tolerance);
}

}  // namespace amontons
