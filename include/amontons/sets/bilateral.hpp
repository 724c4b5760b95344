#pragma once
#include "amontons/sets/barrier.hpp"
#include "amontons/sets/set.hpp"

namespace amontons {

// R: a bilateral row. Projection is the identity, the dual cone is {0}.
struct Bilateral {
  static constexpr int dim = 1;
  static constexpr const char* name = "bilateral";
  static constexpr bool is_cone = true, frictional = false;
  using Barrier = BilateralBarrier;

  void project(const double* x, double* out) const { out[0] = x[0]; }
  void natural_map(const double*, const double* step, double* out) const { out[0] = step[0]; }
  Face<1> face(const double*) const { return face_of_all<1>(1); }
  double violation(const double* u) const { return std::abs(u[0]); }
  std::string complaint(std::size_t) const { return {}; }
};

}  // namespace amontons
