#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "solvers/central_path/curve_units.hpp"
#include "solvers/direct/reduction.hpp"

namespace amontons {

// The VI of an island as a System of the central curve (central_path/central_curve.hpp). By rows its matrix B
// T + W R is dense, and is factored with row pivots.
//
// A thin W is Y'Q Y + E. With D = B T + E R, which is block-diagonal, and C = R D^-1
//
//   D z + Y'w = f,   w = Q Y R z,   so that   (1 + Q Y C Y') w = Q Y C f,   z = D^-1 (f - Y'w),
//
// and only a matrix with a row per coordinate is factored. Its determinant times that of D is that of the
// whole.
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
  // Multiplications of a step along the curve, those of a dense kernel counted as a quarter.
  std::uint64_t work() const;

 private:
  int factor_by_rates(std::span<const double> R, std::span<const double> BT);
  bool solve_by_rates(std::span<const double> q, std::span<double> z) const;

  const SetProduct* K_ = nullptr;
  std::vector<std::size_t> offset_, pivots_;
  CurveUnits units_;
  std::size_t stride_ = 0;  // row stride of matrix_
  std::vector<double> W_, q_, matrix_, columns_;
  // By rates: W in these units; per block D^-1 and C; the rows of C Y.
  ThinMatrix thin_;
  std::vector<std::size_t> rows_;
  std::vector<double> inverse_, C_, T_;
};

}  // namespace amontons
