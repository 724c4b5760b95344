#include "amontons/solvers/first_order/metric.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

// Limit of p_t / p_n: a larger ratio loses its gain to rounding.
constexpr double most_aspect_squared = 10;

BlockMetric friction_metric(const double* diagonal, double P) {
  const double normal = diagonal[0], tangent = 0.5 * (diagonal[1] + diagonal[2]);
  if (!(normal > 0 && tangent > 0)) return {1, P};
  const double squared =
      std::clamp(std::sqrt(tangent / normal), 1 / most_aspect_squared, most_aspect_squared);
  // The mean over the block stays equal to P.
  return {std::sqrt(squared), P * 3 * squared / (1 + 2 * squared)};
}

std::vector<BlockMetric> block_metrics(const Problem& problem) {
  std::vector<double> diagonal(problem.rows());
  amontons::diagonal(problem.A, diagonal);
  std::vector<BlockMetric> metrics(problem.K.blocks());
  for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    if constexpr (std::is_same_v<S, Friction>)
      metrics[block] = friction_metric(&diagonal[row], problem.P[block]);
    else
      metrics[block] = {1, problem.P[block]};
  });
  return metrics;
}

}  // namespace amontons
