#include "amontons/solvers/first_order/metric.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

// Limit of p_t / p_n: a larger ratio loses its gain to rounding.
constexpr double most_aspect_squared = 10;

std::vector<BlockMetric> block_metrics(const Problem& problem) {
  std::vector<double> diagonal(problem.rows());
  amontons::diagonal(problem.A, diagonal);
  std::vector<BlockMetric> metrics(problem.K.blocks());
  for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    metrics[block] = {1, problem.P[block]};
    if constexpr (std::is_same_v<S, Friction>) {
      const double normal = diagonal[row], tangent = 0.5 * (diagonal[row + 1] + diagonal[row + 2]);
      if (!(normal > 0 && tangent > 0)) return;
      const double squared =
          std::clamp(std::sqrt(tangent / normal), 1 / most_aspect_squared, most_aspect_squared);
      // The mean over the block stays equal to P.
      metrics[block] = {std::sqrt(squared), problem.P[block] * 3 * squared / (1 + 2 * squared)};
    }
  });
  return metrics;
}

}  // namespace amontons
