#pragma once
#include <functional>
#include <span>
#include <vector>

#include "picture/projection.hpp"

// Draws triangles into depth buffers, by bands of rows, so that the buffers stay in the cache for any size of
// the picture.
namespace amontons {

// The nearest triangle of each layer for the samples of some rows, -1 for none.
struct Band {
  int first = 0, rows = 0, width = 0;  // the first row of samples, counted from below
  std::vector<double> nearness[layers];
  std::vector<std::int32_t> triangle[layers];

  std::size_t at(int column, int row) const { return static_cast<std::size_t>(row - first) * width + column; }
  void clear(int first_row, int count, int columns);
  void fill(const ScreenTriangle& t, std::int32_t index);
};

// The weights of the corners of a triangle at a sample; their sum is one.
Vec3 weights(const ScreenTriangle& t, double column, double row);

// A picture (samples) in bands of `rows` rows, each with `below` more rows below it.
struct Banded {
  int width, height, rows, below;
};
// Calls done(band) for each band, from several threads.
void rasterise(std::span<const ScreenTriangle> triangles, const Banded& picture, unsigned threads,
               const std::function<void(const Band&)>& done);

}  // namespace amontons
