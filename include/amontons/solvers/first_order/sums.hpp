#pragma once

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

}  // namespace amontons
