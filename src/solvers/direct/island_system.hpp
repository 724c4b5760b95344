#pragma once
#include <span>
#include <vector>

#include "solvers/central_path/curve_units.hpp"
#include "solvers/direct/reduction.hpp"

namespace amontons {

// The VI of an island as a System of the central curve (central_path/central_curve.hpp): dense, with row
// pivoting.
class IslandSystem {
 public:
  // mobility: the mean of diag(W) per block, positive (1/kg).
  void start(const Reduction::Island& island, std::span<const double> mobility);

  const CurveUnits& units() const { return units_; }
  std::size_t offset(std::size_t block) const { return offset_[block]; }
  std::size_t size() const { return offset_.back(); }
  void product(std::span<const double> x, std::span<double> u) const;
  int factor(std::span<const double> R, std::span<const double> BT);
  bool solve(std::span<const double> q, std::span<double> z, int refinements) const;

 private:
  const SetProduct* K_ = nullptr;
  std::vector<std::size_t> offset_, pivots_;
  CurveUnits units_;
  std::size_t stride_ = 0;  // row stride of matrix_
  std::vector<double> W_, q_, matrix_, columns_;
};

}  // namespace amontons
