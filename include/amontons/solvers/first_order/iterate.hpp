#pragma once
#include <concepts>
#include <span>
#include <type_traits>

#include "amontons/problem/problem.hpp"

namespace amontons {

// Sums of the passes of a spectral projected gradient iteration.
struct Direction {
  double dg, dPd;  // <d, g>, <d, P d>
};
struct Update {
  double sy, yPy;           // <s, y>, <y, P^-1 y> with s = x+ - x, y = g+ - g
  double residual_squared;  // of the natural map at x+
};
// Sums of the direction of an accelerated iteration, which starts from the extrapolated point y.
struct MomentumDirection {
  double dPd, dPm;  // <d, P d>, <d, P (y - x)>
};

// What a first-order iterate provides: the point x, u = A x + b, the direction d, and the passes over them.
// P-SPG-FB and APGD are written once over this concept; PlainIterate provides it for any operator,
// ContactIterate with fused kernels for bodies and contacts. Another device supplies a type of this form and
// nothing else.
//
//   start(x0)          x = Pi_K(x0) (0 if empty), u = A x + b; like refresh() it returns the squared natural
//   map refresh()          u = A x + b from scratch, without the rounding that updates gather
//   direction(alpha)   d = Pi_K(x - alpha P^-1 g) - x with g = u + De Saxce term
//   curvature()        <d, A d>: the one product of an iteration
//   update(lambda)     x += lambda d, u += lambda A d; after curvature()
//   start_momentum()   y = x
//   momentum_direction(alpha)   d = Pi_K(y - alpha P^-1 g(y)) - y; may be called again with another alpha
//   accelerate(beta)   x+ = y + d, y = x+ + beta (x+ - x), after curvature(); the squared natural map at x+
//   refresh_momentum() refresh() for x and for y
//   keep_best(), extract_best(x)   the current x becomes the best one; gives it back
//   extract(x)         the current x
//   objective()        1/2 x'Ax + b'x
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
