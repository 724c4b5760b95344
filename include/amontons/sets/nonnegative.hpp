#pragma once

namespace amontons {

// R+: a unilateral row, x >= 0 pushes apart. Self-dual.
struct NonNegative {
  static constexpr int dim = 1;
  void project(const double* x, double* out) const { out[0] = x[0] > 0 ? x[0] : 0.0; }
  void natural_map(const double* x, const double* step, double* out) const {
    out[0] = x[0] - step[0] > 0 ? step[0] : x[0];
  }
};

}  // namespace amontons
