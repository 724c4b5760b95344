#include "solvers/central_path/curve_units.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

void CurveUnits::make(const SetProduct& K, std::span<const double> b, std::span<const double> mobility) {
  K_ = &K;
  beta_ = 0;
  root_.clear();
  for_each_block(K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    root_.push_back(1 / std::sqrt(mobility[block]));
    for (int k = 0; k < S::dim; ++k) beta_ = std::max(beta_, std::abs(b[row + k]) * root_[block]);
  });
  if (!(beta_ > 0)) beta_ = 1;
  unit_.clear();
  for (double root : root_) unit_.push_back(beta_ * root);
}

void CurveUnits::to_impulses(std::span<double> x) const {
  for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int k = 0; k < S::dim; ++k) x[row + k] *= unit_[block];
  });
}

void CurveUnits::from_impulses(std::span<double> x) const {
  for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int k = 0; k < S::dim; ++k) x[row + k] /= unit_[block];
  });
}

// beta^2 may overflow or underflow, so factors are applied one at a time.
void CurveUnits::from_velocities(std::span<double> u) const {
  for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    for (int k = 0; k < S::dim; ++k) u[row + k] = root_[block] * u[row + k] / beta_;
  });
}

}  // namespace amontons
