#pragma once
#include "amontons/sets/barrier.hpp"
#include "amontons/sets/set.hpp"

namespace amontons {

// R+: a unilateral row, x >= 0 pushes apart. Self-dual.
struct NonNegative {
  static constexpr int dim = 1;
  static constexpr const char* name = "nonnegative";
  static constexpr bool is_cone = true, frictional = false;
  struct Barrier : ConeBarrier<1> {
    Barrier(const NonNegative&, double) : ConeBarrier<1>({}) {}
  };

  void project(const double* x, double* out) const { out[0] = x[0] > 0 ? x[0] : 0.0; }
  void natural_map(const double* x, const double* step, double* out) const {
    out[0] = x[0] - step[0] > 0 ? step[0] : x[0];
  }
  Face<1> face(const double* y) const { return face_of_all<1>(y[0] >= 0); }
  double violation(const double* u) const { return -u[0]; }
  std::string complaint(std::size_t) const { return {}; }
};

}  // namespace amontons
