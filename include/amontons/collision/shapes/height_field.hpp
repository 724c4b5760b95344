#pragma once
#include <cstddef>
#include <memory>
#include <span>

#include "amontons/collision/shapes/aabb.hpp"

namespace amontons {

// A static grid of heights over the rectangle centred at the origin: row r, column c lies at
// x = (c / (columns - 1) - 1/2) size_x, y = (r / (rows - 1) - 1/2) size_y, z = heights[r * columns + c]; two
// triangles a cell. Contact from above only.
struct HeightGrid;
struct HeightField {
  std::shared_ptr<const HeightGrid> data;
};

// Throws InputError naming what is wrong: fewer than two rows or columns, another number of heights, sizes or
// heights that are not finite.
HeightField make_height_field(std::span<const double> heights, std::size_t rows, std::size_t columns,
                              double size_x, double size_y);

namespace collision {  // see primitives.hpp

void require_valid(const HeightField& shape);
double radius_about_origin(const HeightField& shape);
Aabb box_around(const HeightField& shape, const Transform& frame);

}  // namespace collision
}  // namespace amontons
