#pragma once
#include <span>

#include "amontons/problem/problem.hpp"

namespace amontons {

// Measures of the error of x. All are zero exactly at a solution of the given law.
//  natural    | P^1/2 (x - Pi_K(x - P^-1 u)) |_2 / max(same at x = 0, rounding): the residual in every
//             method, tolerance and report
//  plain      | x - Pi_K(x - u) |_2
//  plain_inf  the same in the maximum norm
//  siconos    | x - Pi_K(x - u) |_2 / max(|b|_2, |x|_2, |u|_2)
// with u = A x + b (+ the De Saxce term under coulomb).
//
// The natural one is the default. The P metric gives all rows one unit, the root of an energy. The measure
// depends neither on units nor on a common factor of the masses, and is 1 at x = 0.
enum class Norm : unsigned char { natural, plain, plain_inf, siconos };

// p |x - Pi_K(x - u / p)|^2 of one block: the definition of the natural map, shared by residual() and the
// fused passes of the solvers. g: u with the De Saxce term.
template <class S>
inline double natural_map_squared(const S& set, double p, const double* x, const double* g) {
  double step[S::dim], r[S::dim], sum = 0;
  for (int k = 0; k < S::dim; ++k) step[k] = g[k] / p;
  set.natural_map(x, step, r);
  for (int k = 0; k < S::dim; ++k) sum += r[k] * r[k];
  return p * sum;
}

// The residual of x given u = A x + b.
double residual(const Problem& problem, Law law, std::span<const double> x, std::span<const double> u,
                Norm norm = Norm::natural);
// The numerator of the natural residual, and its denominator: the same at x = 0, at least the root of the
// rounding of |P^-1/2 b|.
double natural_map(const Problem& problem, Law law, std::span<const double> x, std::span<const double> u);
double natural_map_at_zero(const Problem& problem, Law law);
// The vector whose P norm that is: r = x - Pi_K(x - P^-1 g), g = A x + b (+ the De Saxce term).
void natural_map_step(const Problem& problem, Law law, std::span<const double> x, std::span<double> r);
// Forms u = A x + b first; one product.
double residual(const Problem& problem, Law law, std::span<const double> x, Norm norm = Norm::natural);
// Under the law of the problem.
inline double residual(const Problem& problem, std::span<const double> x, Norm norm = Norm::natural) {
  return residual(problem, problem.law, x, norm);
}

// The physical meaning of the residual. Each number is zero at a solution, but none is a stopping criterion
// alone.
struct Violations {
  double penetration_velocity;  // max over contacts and unilateral rows of -u_n (m/s), bilateral rows |u|
  double cone;                  // max distance of x to its cone (N s)
  double complementarity;       // max |<x, u>| over blocks, u with the De Saxce term (J)
  double energy;                // 1/2 e'Ae of the natural map's step e = x - Pi_K(x - P^-1 u) (J)
};
Violations violations(const Problem& problem, Law law, std::span<const double> x);
inline Violations violations(const Problem& problem, std::span<const double> x) {
  return violations(problem, problem.law, x);
}

}  // namespace amontons
