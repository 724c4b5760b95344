// Barriers at a point of the curve near a given x and u, for any set but rolling friction.
//
// With y = x - u, u with the De Saxce term, this point has x - w = y and x o w = t e. It is the smoothed
// projection of y and of -y (Chen, Harker 1993; Kanzow 1996): for a half-line
//
//   x = (y + sqrt(y^2 + 4 t)) / 2,   w = t / x,
//
// so that x and w are y and 0, or 0 and -y, but for about t / |y|. Where |y| is below sqrt(t) both are about
// sqrt(t): the face is open. A solution has its own point for every t, and F = w - u there is as small. x and
// u are in the units of the barriers.
#pragma once
#include <cmath>
#include <cstddef>

#include "amontons/sets/barrier.hpp"
#include "amontons/sets/interval.hpp"

namespace amontons::curve {

// The root x > 0 of x - t / x = l, without cancellation.
inline double beyond(double l, double t) {
  const double root = std::sqrt(l * l + 4 * t);
  return l > 0 ? 0.5 * (l + root) : 2 * t / (root - l);
}

inline void start_near(BilateralBarrier& barrier, const double* x, const double*, double) {
  barrier.start(x);
}

// y has two parts along one frame of Jordan's algebra; x has the roots of these, w has t over them.
template <std::size_t n>
void start_near(ConeBarrier<n>& barrier, const double* x, const double* u, double t) {
  second_order::V<n> y{};
  for (std::size_t k = 0; k < n; ++k)
    if (barrier.live[k]) y[k] = barrier.D[k] * x[k] - u[k] / barrier.D[k];
  const double size = second_order::tail(y);
  const double high = beyond(y[0] + size, t), low = beyond(y[0] - size, t);
  barrier.x[0] = 0.5 * (high + low);
  barrier.u[0] = 0.5 * (t / high + t / low);
  for (std::size_t k = 1; k < n; ++k) {
    const double along = size > 0 ? 0.5 * y[k] / size : 0;
    barrier.x[k] = along * (high - low);
    barrier.u[k] = along * (t / high - t / low);
  }
}

// The root of x - t / (x - lo) + t / (hi - x) = y lies between those for one bound alone. A step of the
// barrier moves x there, and a second one, which leaves x, brings the multipliers to t over the distances.
inline void start_near(Interval::Barrier& barrier, const Interval& set, double unit, const double* x,
                       const double* u, double t) {
  const double y = x[0] - u[0], lo = set.lo / unit, hi = set.hi / unit;
  if (lo == hi || (std::isinf(lo) && std::isinf(hi))) return barrier.start(x);
  double low = std::isinf(hi) ? lo + beyond(y - lo, t) : hi - beyond(hi - y, t);
  double high = std::isinf(lo) ? low : lo + beyond(y - lo, t);
  constexpr int halvings = 60;  // not tuned: to rounding
  for (int i = 0; low < high && i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    const double error = middle - y - t / (middle - lo) + t / (hi - middle);
    (middle > lo && (middle >= hi || error > 0) ? high : low) = middle;
  }
  double from, R, rho, z;
  for (const bool moves : {true, false}) {
    barrier.factor(&R);
    barrier.target(t, false, &rho);
    barrier.primal(&from);
    z = moves ? (0.5 * (low + high) - from) / R : 0;
    barrier.recover(t, &z);
    barrier.move(1);
  }
}

}  // namespace amontons::curve
