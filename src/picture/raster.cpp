#include "picture/raster.hpp"

#include <algorithm>
#include <limits>

#include "amontons/base/threads.hpp"

namespace amontons {

void Band::clear(int first_row, int count, int columns) {
  first = first_row;
  rows = count;
  width = columns;
  for (int k = 0; k < layers; ++k) {
    nearness[k].assign(static_cast<std::size_t>(rows) * width, -std::numeric_limits<double>::infinity());
    triangle[k].assign(static_cast<std::size_t>(rows) * width, -1);
  }
}

// A sample is inside if its three edge functions, twice the areas of its triangles with the edges, are not
// negative. Corners are multiples of 2^-8 and samples of 1/2: products and sums are exact up to 2^18 samples,
// so that both triangles cannot miss a sample on their common edge.
void Band::fill(const ScreenTriangle& t, std::int32_t index) {
  const auto [low_x, high_x] = std::minmax({t.x[0], t.x[1], t.x[2]});
  const auto [low_y, high_y] = std::minmax({t.y[0], t.y[1], t.y[2]});
  const int left = std::max(0, static_cast<int>(std::ceil(std::max(low_x, 0.0) - 0.5)));
  const int right = static_cast<int>(std::floor(std::min(high_x, static_cast<double>(width)) - 0.5));
  const int bottom = std::max(first, static_cast<int>(std::ceil(std::max(low_y, 0.0) - 0.5)));
  const int top = static_cast<int>(std::floor(std::min(high_y, static_cast<double>(first + rows)) - 0.5));
  if (right < left) return;
  double across[3], up[3], start[3];
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    across[k] = t.y[a] - t.y[b];
    up[k] = t.x[b] - t.x[a];
    start[k] = across[k] * (left + 0.5 - t.x[a]) + up[k] * (bottom + 0.5 - t.y[a]);
  }
  auto& near = nearness[static_cast<int>(t.layer)];
  auto& owner = triangle[static_cast<int>(t.layer)];
  const double n0 = t.nearness[0] / t.area, n1 = t.nearness[1] / t.area, n2 = t.nearness[2] / t.area;
  for (int row = bottom; row <= top; ++row) {
    const std::size_t line = at(0, row);
    double e0 = start[0], e1 = start[1], e2 = start[2];
    for (int column = left; column <= right; ++column) {
      if (std::min({e0, e1, e2}) >= 0) {
        const double here = e0 * n0 + e1 * n1 + e2 * n2;
        if (here > near[line + column]) {
          near[line + column] = here;
          owner[line + column] = index;
        }
      }
      e0 += across[0], e1 += across[1], e2 += across[2];
    }
    for (int k = 0; k < 3; ++k) start[k] += up[k];
  }
}

Vec3 weights(const ScreenTriangle& t, double column, double row) {
  Vec3 w;
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    w[k] = ((t.y[a] - t.y[b]) * (column - t.x[a]) + (t.x[b] - t.x[a]) * (row - t.y[a])) / t.area;
  }
  return w;
}

void rasterise(std::span<const ScreenTriangle> triangles, const Banded& picture, unsigned threads,
               const std::function<void(const Band&)>& done) {
  const auto& [width, height, rows, below] = picture;
  const int count = (height + rows - 1) / rows;
  std::vector<std::vector<std::int32_t>> bins(count);
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    const auto [low, high] = std::minmax({triangles[k].y[0], triangles[k].y[1], triangles[k].y[2]});
    const double last = height - 1;
    const int from = static_cast<int>(std::clamp(low, 0.0, last)) / rows;
    const int to = (static_cast<int>(std::clamp(high, 0.0, last)) + below) / rows;
    for (int b = from; b <= std::min(to, count - 1); ++b) bins[b].push_back(static_cast<std::int32_t>(k));
  }
  PoolLease pool(automatic_threads(threads, count));
  pool->run(count, [&](std::size_t b) {
    Band band;
    const int first = std::max(0, static_cast<int>(b) * picture.rows - picture.below);
    band.clear(first, std::min(picture.height, (static_cast<int>(b) + 1) * picture.rows) - first,
               picture.width);
    for (const std::int32_t k : bins[b]) band.fill(triangles[k], k);
    done(band);
  });
}

}  // namespace amontons
