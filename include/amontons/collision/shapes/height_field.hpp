#pragma once
#include <cstddef>
#include <memory>
#include <span>

#include "amontons/collision/shapes/aabb.hpp"

namespace amontons {

// A static grid of heights over the rectangle centred at the origin: row r, column c lies at
//   x = (c / (columns - 1) - 1/2) size_x,  y = (r / (rows - 1) - 1/2) size_y,  z = heights[r columns + c]
// in the frame of the shape, all in m; two triangles per cell, as in src/collision/shapes/height_grid.hpp.
// Contact from above only: the field is solid below its surface. Copies share the heights, which never
// change.
struct HeightGrid;
struct HeightField {
  std::shared_ptr<const HeightGrid> data;
};

// Throws InputError naming the error: fewer than two rows or columns, a wrong number of heights, sizes or
// heights that are not finite.
HeightField make_height_field(std::span<const double> heights, std::size_t rows, std::size_t columns,
                              double size_x, double size_y);
// The arguments that make_height_field had, to write the field to a file. The view lives as long as a copy of
// the field does.
struct Heights {
  std::span<const double> values;
  std::size_t rows, columns;
  double size_x, size_y;
};
Heights heights_of(const HeightField& field);

}  // namespace amontons
