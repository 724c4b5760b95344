#include "collision/pairs/height_field.hpp"

#include <string>

#include "amontons/base/error.hpp"
#include "collision/narrow/surface.hpp"

namespace amontons {
namespace collision {
namespace {

// See SurfaceContact. Triangle 2 k of cell k has the corners (r, c), (r, c + 1), (r + 1, c + 1), below the
// diagonal; triangle 2 k + 1 has (r, c), (r + 1, c + 1), (r + 1, c). Vertex r columns + c is (r, c).
struct GridSurface {
  const HeightGrid& grid;

  bool has(std::int64_t r, std::int64_t c) const {
    return r >= 0 && r < grid.rows && c >= 0 && c < grid.columns;
  }
  double height(std::int64_t r, std::int64_t c) const {
    return grid.heights[static_cast<std::size_t>(r * grid.columns + c)];
  }
  Vec3 point(std::int64_t r, std::int64_t c) const {
    return {(static_cast<double>(c) / static_cast<double>(grid.columns - 1) - 0.5) * grid.size_x,
            (static_cast<double>(r) / static_cast<double>(grid.rows - 1) - 0.5) * grid.size_y, height(r, c)};
  }
  // Coordinates in cells.
  double column_at(double x) const { return (x / grid.size_x + 0.5) * static_cast<double>(grid.columns - 1); }
  double row_at(double y) const { return (y / grid.size_y + 0.5) * static_cast<double>(grid.rows - 1); }

  // What lies above the box by up to the box's own size counts as near: the field is solid below its surface.
  template <class F>
  void for_each_near(const Aabb& box, F&& visit) const {
    const double c0 = column_at(box.lower.x), c1 = column_at(box.upper.x), r0 = row_at(box.lower.y),
                 r1 = row_at(box.upper.y);
    const Vec3 size = box.upper - box.lower;
    const double top = box.upper.z + std::max({size.x, size.y, size.z});
    const auto last_column = static_cast<double>(grid.columns - 2),
               last_row = static_cast<double>(grid.rows - 2);
    if (!(c1 >= 0 && c0 <= last_column + 1 && r1 >= 0 && r0 <= last_row + 1)) return;
    if (grid.highest < box.lower.z || grid.lowest > top) return;
    const auto cell = [](double at, double last) {
      return static_cast<std::int64_t>(std::clamp(std::floor(at), 0.0, last));
    };
    const std::int64_t left = cell(c0, last_column), right = cell(c1, last_column), back = cell(r0, last_row),
                       front = cell(r1, last_row);
    for (std::int64_t r = back; r <= front; ++r)
      for (std::int64_t c = left; c <= right; ++c) {
        const double a = height(r, c), d = height(r + 1, c + 1);
        for (int upper = 0; upper < 2; ++upper) {
          const double b = upper ? height(r + 1, c) : height(r, c + 1);
          if (std::max({a, b, d}) >= box.lower.z && std::min({a, b, d}) <= top)
            visit(2 * (r * (grid.columns - 1) + c) + upper);
        }
      }
  }

  Facet facet(std::int64_t t) const {
    const std::int64_t r = t / 2 / (grid.columns - 1), c = t / 2 % (grid.columns - 1);
    struct Site {
      std::int64_t r, c;
    };
    const Site origin{r, c}, diagonal{r + 1, c + 1};
    const Site corners[2][3] = {{origin, {r, c + 1}, diagonal}, {origin, diagonal, {r + 1, c}}};
    const Site opposite[2][3] = {{{r - 1, c}, {r + 1, c + 2}, {r + 1, c}},
                                 {{r, c + 1}, {r + 2, c + 1}, {r, c - 1}}};
    Facet f;
    for (int k = 0; k < 3; ++k) {
      const Site at = corners[t % 2][k];
      f.corner[k] = point(at.r, at.c), f.vertex[k] = at.r * grid.columns + at.c;
    }
    f.normal = normal_of(f.corner[0], f.corner[1], f.corner[2]);
    for (int k = 0; k < 3; ++k) {
      const Site at = opposite[t % 2][k];
      f.edge[k] = EdgeKind::border, f.opposite[k] = f.corner[k];
      if (!has(at.r, at.c)) continue;
      const Vec3 &a = f.corner[k], &b = f.corner[(k + 1) % 3];
      f.opposite[k] = point(at.r, at.c);
      f.edge[k] = edge_kind(a, b, f.normal, normal_of(b, a, f.opposite[k]), f.opposite[k]);
    }
    return f;
  }

  static Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
    return normalised(cross(b - a, c - a));
  }

  // The six around (r, c), counter-clockwise.
  static constexpr int around[6][2] = {{0, 1}, {1, 1}, {1, 0}, {0, -1}, {-1, -1}, {-1, 0}};

  template <class F>
  void for_each_neighbour(std::int64_t vertex, F&& visit) const {
    const std::int64_t r = vertex / grid.columns, c = vertex % grid.columns;
    for (const auto& [dr, dc] : around)
      if (has(r + dr, c + dc)) visit(point(r + dr, c + dc));
  }

  bool is_active(std::int64_t vertex) const { return grid.is_active[static_cast<std::size_t>(vertex)]; }

  bool has_active_edge(std::int64_t vertex) const {
    const std::int64_t r = vertex / grid.columns, c = vertex % grid.columns;
    if (r == 0 || c == 0 || r == grid.rows - 1 || c == grid.columns - 1) return true;
    const Vec3 at = point(r, c);
    Vec3 ring[6];
    for (int k = 0; k < 6; ++k) ring[k] = point(r + around[k][0], c + around[k][1]);
    for (int k = 0; k < 6; ++k) {
      const Vec3 &before = ring[(k + 5) % 6], &end = ring[k], &after = ring[(k + 1) % 6];
      if (edge_kind(at, end, normal_of(at, end, after), normal_of(at, before, end), before) != EdgeKind::flat)
        return true;
    }
    return false;
  }

  bool is_outside(const Vec3& p, std::int64_t, const Vec3&, unsigned) const {
    const double column = column_at(p.x), row = row_at(p.y);
    if (!(column >= 0 && row >= 0 && column <= static_cast<double>(grid.columns - 1) &&
          row <= static_cast<double>(grid.rows - 1)))
      return true;
    const auto r = std::min(static_cast<std::int64_t>(row), grid.rows - 2);
    const auto c = std::min(static_cast<std::int64_t>(column), grid.columns - 2);
    const double u = column - static_cast<double>(c), v = row - static_cast<double>(r);
    const double a = height(r, c), d = height(r + 1, c + 1);
    const double b = u > v ? height(r, c + 1) : height(r + 1, c);
    // Linear over the triangle: (a, b, d) along the two legs, of lengths |u - v| apart and min(u, v)
    // together.
    const double surface = a + std::min(u, v) * (d - a) + std::abs(u - v) * (b - a);
    return p.z > surface;
  }
};

}  // namespace

void collide_height_field(const HeightGrid& grid, const Transform& frame_grid, const Shape& convex,
                          const Transform& frame_convex, double margin, std::vector<ContactPoint>& points) {
  collide_surface(GridSurface{grid}, frame_grid, convex, frame_convex, margin, points);
}

Aabb local_bounds(const HeightGrid& grid) {
  const double x = grid.size_x / 2, y = grid.size_y / 2;
  return {{-x, -y, grid.lowest}, {x, y, grid.highest}};
}

}  // namespace collision

HeightField make_height_field(std::span<const double> heights, std::size_t rows, std::size_t columns,
                              double size_x, double size_y) {
  AMONTONS_REQUIRE(rows >= 2 && columns >= 2,
                   "height field: it needs at least two rows and two columns, not " + std::to_string(rows) +
                       " and " + std::to_string(columns));
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
  const auto [lowest, highest] = std::minmax_element(heights.begin(), heights.end());
  auto grid = std::make_shared<HeightGrid>();
  grid->heights.assign(heights.begin(), heights.end());
  grid->rows = static_cast<std::int64_t>(rows), grid->columns = static_cast<std::int64_t>(columns);
  grid->size_x = size_x, grid->size_y = size_y;
  grid->lowest = *lowest, grid->highest = *highest;
  const collision::GridSurface surface{*grid};
  for (std::int64_t v = 0; v < grid->rows * grid->columns; ++v)
    grid->is_active.push_back(surface.has_active_edge(v));
  return {std::move(grid)};
}

}  // namespace amontons
