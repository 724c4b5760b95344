#include "amontons/collision/shapes/height_field.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "amontons/base/error.hpp"
#include "collision/shapes/height_grid.hpp"

namespace amontons {

// Checks the input, copies the heights and marks the active vertices.
HeightField make_height_field(std::span<const double> heights, std::size_t rows, std::size_t columns,
                              double size_x, double size_y) {
  AMONTONS_REQUIRE(rows >= 2 && columns >= 2,
                   "height field: it needs at least two rows and two columns, not " + std::to_string(rows) +
                       " and " + std::to_string(columns));
  // By division: rows times columns could overflow.
  AMONTONS_REQUIRE(heights.size() / rows == columns && heights.size() % rows == 0,
                   "height field: " + std::to_string(rows) + " rows of " + std::to_string(columns) +
                       " heights are needed, but there are " + std::to_string(heights.size()) + " heights");
  AMONTONS_REQUIRE(size_x > 0 && size_y > 0 && std::isfinite(size_x) && std::isfinite(size_y),
                   "height field: size_x and size_y must be positive and finite, not " +
                       std::to_string(size_x) + " and " + std::to_string(size_y));
  for (std::size_t i = 0; i < heights.size(); ++i)
    AMONTONS_REQUIRE(std::isfinite(heights[i]), "height field: the height in row " +
                                                    std::to_string(i / columns) + ", column " +
                                                    std::to_string(i % columns) + " is not finite");
  // No other error is possible: any finite heights make a surface. The range of heights is a quick test for
  // bodies above the field, the active vertices one for normals. Both are computed once, because the field
  // never changes.
  const auto [lowest, highest] = std::minmax_element(heights.begin(), heights.end());
  const auto r = static_cast<std::int64_t>(rows), c = static_cast<std::int64_t>(columns);
  auto grid = std::make_shared<HeightGrid>(
      HeightGrid{std::vector(heights.begin(), heights.end()), r, c, size_x, size_y, *lowest, *highest, {}});
  const collision::GridSurface surface{*grid};
  for (std::int64_t v = 0; v < r * c; ++v) grid->is_active.push_back(surface.has_active_edge(v));
  return {std::move(grid)};
}

// A view of the data of the field, without a copy of its heights. It lives as long as a copy of the
// field does.
Heights heights_of(const HeightField& field) {
  const HeightGrid& grid = *field.data;
  return {grid.heights, static_cast<std::size_t>(grid.rows), static_cast<std::size_t>(grid.columns),
          grid.size_x, grid.size_y};
}

}  // namespace amontons
