#pragma once

namespace amontons {

// R: a bilateral row. Projection is the identity, the dual cone is {0}.
struct Free {
  static constexpr int dim = 1;
  void project(const double* x, double* out) const { out[0] = x[0]; }
  void natural_map(const double*, const double* step, double* out) const { out[0] = step[0]; }
};

}  // namespace amontons
