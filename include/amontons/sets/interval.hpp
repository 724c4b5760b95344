#pragma once

namespace amontons {

// [lo, hi]: a motor or a joint friction with limited effort; either bound may be infinite. Not a cone unless
// its bounds are 0 or infinite: "polar" below means the normal cone at the projection.
struct Interval {
  static constexpr int dim = 1;
  double lo, hi;
  void project(const double* x, double* out) const { out[0] = x[0] < lo ? lo : (x[0] > hi ? hi : x[0]); }
  void natural_map(const double* x, const double* step, double* out) const {
    const double trial = x[0] - step[0];
    out[0] = trial < lo ? x[0] - lo : (trial > hi ? x[0] - hi : step[0]);
  }
};

}  // namespace amontons
