#pragma once
#include <concepts>
#include <span>

#include "amontons/problem/problem.hpp"

namespace amontons {

// A pass over the iterate returns only scalars, so that the vectors may live on another device.
//
// Sums of a spectral projected gradient iteration, from which the method finds lambda and the next alpha.
struct Direction {
  double dg, dPd;  // <d, g>, <d, P d>
};
struct Update {
  double sy, yPy;           // <s, y>, <y, P^-1 y> with s = x+ - x, y = g+ - g
  double residual_squared;  // squared natural map at x+
};
// Sums of the direction of an accelerated iteration, which starts from the extrapolated point y.
struct MomentumDirection {
  double dPd, dPm;  // <d, P d>, <d, P (y - x)>
};

// Operations of a first-order iterate: the point x, u = A x + b, the direction d, and the passes over them.
// P-SPG-FB and APGD are written once over this concept. PlainIterate provides it for any operator,
// ContactIterate with fused kernels for bodies and contacts. Another device only needs to supply a type of
// this form.
//
// g(x) is u plus the De Saxce term of u (associated: g = u). K, P, b and the law are given at construction.
// "The residual" below is always |x - Pi_K(x - P^-1 g)|^2 in the P metric, the square of the natural map. The
// driver divides its root by the value at x = 0.
//
// Always:
//   start(x0)         x = Pi_K(x0), x0 = 0 if it is empty; u = A x + b; the residual
//   refresh()         u = A x + b from scratch, without the rounding that updates accumulate; the residual
//   keep_best()       the current x becomes the best one; called often, so that it must not copy
//   extract_best(x), extract(x)   the best x, and the current one, in the order of the problem
//   objective()       1/2 x'Ax + b'x
// P-SPG-FB, in this order:
//   direction(alpha)  d = Pi_K(x - alpha P^-1 g(x)) - x
//   curvature()       <d, A d>: the one product of an iteration
//   update(lambda)    x += lambda d, u += lambda A d
// APGD, in this order; after a rejected step the middle two are repeated with a smaller alpha:
//   start_momentum()            y = x, once after start()
//   momentum_direction(alpha)   d = Pi_K(y - alpha P^-1 g) - y, P of metric.hpp, g = A y + b and the De Saxce
//                               term of x; y and x stay as they are
//   curvature()                 as above
//   accelerate(beta)            x+ = y + d, y = x+ + beta (x+ - x); the residual at x+
//   refresh_momentum()          refresh() for x and for y; the residual at x
template <class T>
concept Iterate = requires(T& t, const T& c, std::span<const double> x0, std::span<double> x, double step) {
  { t.start(x0) } -> std::same_as<double>;
  { t.refresh() } -> std::same_as<double>;
  { t.direction(step) } -> std::same_as<Direction>;
  { t.curvature() } -> std::same_as<double>;
  { t.update(step) } -> std::same_as<Update>;
  t.start_momentum();
  { t.momentum_direction(step) } -> std::same_as<MomentumDirection>;
  { t.accelerate(step) } -> std::same_as<double>;
  { t.refresh_momentum() } -> std::same_as<double>;
  t.keep_best();
  c.extract_best(x);
  c.extract(x);
  { c.objective() } -> std::same_as<double>;
};

}  // namespace amontons
