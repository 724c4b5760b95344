// A solution of the VI, docs/algorithm.md (11, 12), is a fixed point of x -> Pi_K(x - t P^-1 g(x)) for any t
// > 0. The natural map is the deviation from that at t = 1 in the metric of P. A step then has the size of
// the impulse that would bring each block to rest.
#include "amontons/problem/residual.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {

namespace {

double norm2(std::span<const double> x) {
  double sum = 0;
  for (double v : x) sum += v * v;
  return std::sqrt(sum);
}

// u = A x + b
std::vector<double> apply(const Problem& problem, std::span<const double> x) {
  std::vector<double> u(problem.rows());
  product(problem.A, x, u);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += problem.b[i];
  return u;
}

}  // namespace

// The P norm of x - Pi_K(x - P^-1 g) over all blocks, g = u + De Saxce term.
double natural_map(const Problem& problem, Law law, std::span<const double> x, std::span<const double> u) {
  double sum = 0;
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double g[S::dim];
    add_de_saxce_term(set, law, &u[row], g);
    sum += natural_map_squared(set, problem.P[block], &x[row], g);
  });
  return std::sqrt(sum);
}

void natural_map_step(const Problem& problem, Law law, std::span<const double> x, std::span<double> r) {
  const std::vector<double> u = apply(problem, x);
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double step[S::dim];
    add_de_saxce_term(set, law, &u[row], step);
    for (double& s : step) s /= problem.P[block];
    set.natural_map(&x[row], step, &r[row]);
  });
}

// docs/algorithm.md (16). At x = 0, u = b: the length of Pi_K(-P^-1 b) in the P metric, to which the residual
// is relative. Where contacts slide and do not approach, that projection is a difference of equal terms: 0 is
// a solution but for rounding, and no x would be better. The root of the rounding of g as the least share of
// |P^-1/2 g| divides the digits evenly: residuals show rounding as no more than that root, and errors of less
// than that share of g count less. 1e-300 keeps the quotient of two zeros at zero.
double natural_map_at_zero(const Problem& problem, Law law) {
  double sum = 0, whole = 0;
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    const double zero[S::dim] = {};
    double g[S::dim];
    add_de_saxce_term(set, law, &problem.b[row], g);
    sum += natural_map_squared(set, problem.P[block], zero, g);
    for (const double v : g) whole += v * v / problem.P[block];
  });
  return std::max(std::sqrt(std::max(sum, std::numeric_limits<double>::epsilon() * whole)), 1e-300);
}

// The other norms take the step g itself, as if P were 1/kg: they depend on units and serve for comparison
// with other software. They are differences and suffer from cancellation.
double residual(const Problem& problem, Law law, std::span<const double> x, std::span<const double> u,
                Norm norm) {
  // The natural residual is formed without cancellation, block by block by the sets (residual.hpp).
  if (norm == Norm::natural) return natural_map(problem, law, x, u) / natural_map_at_zero(problem, law);
  double sum = 0, largest = 0;
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t, std::size_t row) {
    double g[S::dim], trial[S::dim], foot[S::dim];
    add_de_saxce_term(set, law, &u[row], g);
    for (int k = 0; k < S::dim; ++k) trial[k] = x[row + k] - g[k];
    set.project(trial, foot);
    for (int k = 0; k < S::dim; ++k) {
      const double r = x[row + k] - foot[k];
      sum += r * r;
      largest = std::max(largest, std::abs(r));
    }
  });
  if (norm == Norm::plain) return std::sqrt(sum);
  if (norm == Norm::plain_inf) return largest;
  return std::sqrt(sum) / std::max({norm2(problem.b), norm2(x), norm2(u), 1e-300});
}

double residual(const Problem& problem, Law law, std::span<const double> x, Norm norm) {
  return residual(problem, law, x, apply(problem, x), norm);
}

// Two projections per block: of the trial point for the step e of the natural map, and of x itself for its
// distance to K.
Violations violations(const Problem& problem, Law law, std::span<const double> x) {
  const std::vector<double> u = apply(problem, x);
  std::vector<double> e(problem.rows()), Ae(problem.rows());
  Violations v{};
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    // work: <x, g> of the block, zero where the impulse and the gradient are complementary.
    double g[S::dim], trial[S::dim], foot[S::dim], work = 0, outside = 0;
    add_de_saxce_term(set, law, &u[row], g);
    for (int k = 0; k < S::dim; ++k) trial[k] = x[row + k] - g[k] / problem.P[block];
    set.project(trial, foot);
    for (int k = 0; k < S::dim; ++k) {
      e[row + k] = x[row + k] - foot[k];
      work += x[row + k] * g[k];
    }
    set.project(&x[row], foot);
    for (int k = 0; k < S::dim; ++k) outside += (x[row + k] - foot[k]) * (x[row + k] - foot[k]);
    v.cone = std::max(v.cone, std::sqrt(outside));
    v.penetration_velocity = std::max(v.penetration_velocity, set.violation(&u[row]));
    // For bilateral rows u is the violation; an interval balances it against its bounds.
    if constexpr (S::is_cone && !std::is_same_v<S, Bilateral>)
      v.complementarity = std::max(v.complementarity, std::abs(work));
  });
  product(problem.A, e, Ae);
  // e is an impulse (N s), A e its effect on the velocity (m/s): 1/2 e'Ae is the kinetic energy of that (J).
  for (std::size_t i = 0; i < e.size(); ++i) v.energy += 0.5 * e[i] * Ae[i];
  return v;
}

}  // namespace amontons
