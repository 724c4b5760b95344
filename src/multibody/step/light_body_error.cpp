// For a block with p, the mean of its diag(A), the square of the natural map is m v^2, m = 1 / p, where v is
// its velocity error (residual.hpp). With U, its velocity without impulses, in place of v, this is the
// contribution of the block to the norm of the whole problem. If the contribution is below the tolerance, the
// residual does not see the block at all.
#include "multibody/step/light_body_error.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "amontons/base/policy.hpp"
#include "amontons/problem/residual.hpp"
#include "multibody/step/policy.hpp"

namespace amontons {

namespace {

// The velocity of a block: normal and tangential, without spins.
template <class S>
double speed(const double* v) {
  double sum = 0;
  for (int k = 0; k < std::min(S::dim, 3); ++k) sum += v[k] * v[k];
  return std::sqrt(sum);
}

// The velocity of a spring or servo is no measure of its error, because E dominates its diag(A).
bool is_soft(const Problem& problem, std::size_t block, std::size_t row) {
  const auto& A = std::get<ContactSystem>(problem.A);
  const std::size_t contacts = A.contacts.size();
  if (block < contacts) return A.contact_compliance[block] > 0.5 * problem.P[block];
  return A.compliance[row - (problem.rows() - A.jacobian.size())] > 0.5 * problem.P[block];
}

}  // namespace

double tolerance_for_light_bodies(const Problem& problem, Law law, const Solution& s, const Speeds& fastest,
                                  double tolerance) {
  const double least_miss = base::policy.rounding * (fastest.moving + fastest.turning);
  const double whole = natural_map_at_zero(problem, law), seen = tolerance * whole;
  double heaviest = 0;
  for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    if (is_soft(problem, block, row)) return;
    heaviest = std::max(heaviest, 1 / problem.P[block]);
  });
  double found = std::numeric_limits<double>::infinity();
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    if (is_soft(problem, block, row)) return;
    const double p = problem.P[block];
    // A light body counts as moving with a small share of the speed of the fastest one, if it is slower.
    const bool light = 1 / p < tolerance * heaviest;
    const double U = speed<S>(&problem.b[row]) + (light ? base::policy.three_digits : 1) * fastest.moving;
    // If a block slides or rolls, the natural map of a steep cone contains its closing velocity only times 1
    // / mu.
    double steep = 1, closing = 0;
    if constexpr (S::frictional) {
      constexpr double slips[6] = {0, 1, 1, 1, 1, 1};
      steep = 1 + set.de_saxce(slips) * set.de_saxce(slips);
      closing = set.violation(&s.u[row]);
    }
    if (!(step::policy.wrong * step::policy.wrong * U * U < p * steep * seen * seen)) return;
    double g[S::dim];
    add_de_saxce_term(set, law, &s.u[row], g);
    const double missed = std::max(closing, std::sqrt(natural_map_squared(set, p, &s.x[row], g) * p));
    const double weight = 1 / std::sqrt(p * steep);
    if (missed > std::max(step::policy.wrong * U, least_miss) &&
        missed * weight > base::policy.rounding * whole)
      found = std::min(found, step::policy.wrong * U * weight);
  });
  return std::max(found / whole, base::policy.rounding);
}

}  // namespace amontons
