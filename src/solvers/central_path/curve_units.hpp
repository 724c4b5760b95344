#pragma once
#include <span>
#include <vector>

#include "amontons/sets/product.hpp"

namespace amontons {

// Units in which the part of A of each block, and the largest entry of b, are of order one:
//
//   x = unit x~,   u = (beta / root) u~,   unit = beta root,   root = 1 / sqrt(mobility),
//
// so that <x, u> = beta^2 <x~, u~> and A~ = root A root.
class CurveUnits {
 public:
  // mobility: the mean of diag(A) per block, positive (1/kg). K must outlive it.
  void make(const SetProduct& K, std::span<const double> b, std::span<const double> mobility);
  // Unit of x per block (N s).
  std::span<const double> of_x() const { return unit_; }
  double root(std::size_t block) const { return root_[block]; }
  // Transforms x~ to x and back, u to u~, in place.
  void to_impulses(std::span<double> x) const;
  void from_impulses(std::span<double> x) const;
  void from_velocities(std::span<double> u) const;

 private:
  const SetProduct* K_ = nullptr;
  double beta_ = 1;
  std::vector<double> unit_, root_;
};

}  // namespace amontons
