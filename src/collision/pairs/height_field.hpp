#pragma once
#include <cstdint>
#include <vector>

#include "amontons/collision/pairs/collide.hpp"

namespace amontons {

// Cell (r, c) lies between rows r and r + 1 and columns c and c + 1. Its diagonal goes from the corner (r, c)
// to (r + 1, c + 1), as in MuJoCo.
struct HeightGrid {
  std::vector<double> heights;
  std::int64_t rows, columns;
  double size_x, size_y;
  double lowest, highest;
  std::vector<unsigned char> is_active;  // per vertex: whether an edge ends there that is not flat
};

namespace collision {

// Appends the contact points of a height field with a convex shape; the normals point up, from the field to
// the shape. A shape that has sunk below the surface by no more than its own height is pushed out.
void collide_height_field(const HeightGrid& grid, const Transform& frame_grid, const Shape& convex,
                          const Transform& frame_convex, double margin, std::vector<ContactPoint>& points);

Aabb local_bounds(const HeightGrid& grid);

}  // namespace collision
}  // namespace amontons
