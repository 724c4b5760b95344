#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "amontons/collision/shapes/aabb.hpp"
#include "collision/shapes/facet.hpp"

namespace amontons {

// Cell (r, c) is between rows r and r + 1 and columns c and c + 1. Its diagonal goes from the corner (r, c)
// to (r + 1, c + 1), as in MuJoCo:
//
//     (r + 1, c) +-----+ (r + 1, c + 1)     y
//                |  1 /|                    ^
//                |  /  |                    |
//                |/  0 |                    +--> x
//         (r, c) +-----+ (r, c + 1)
//
// Only the heights are stored per cell: corners, normals and the kinds of edges are computed when a body
// comes near. That takes less than a twentieth of the memory of a mesh, and no tree.
struct HeightGrid {
  std::vector<double> heights;
  std::int64_t rows, columns;
  double size_x, size_y;                 // of the rectangle below, m
  double lowest, highest;                // height
  std::vector<unsigned char> is_active;  // per vertex: whether an edge that is not flat ends there

  // Around all of it, in its own frame.
  Aabb box() const { return {{-size_x / 2, -size_y / 2, lowest}, {size_x / 2, size_y / 2, highest}}; }
};

namespace collision {

// The Surface for narrow/surface.hpp, by arithmetic alone. Triangle 2 k of cell k has the corners (r, c), (r,
// c + 1), (r + 1, c + 1), below the diagonal; triangle 2 k + 1 has (r, c), (r + 1, c + 1), (r + 1, c). Vertex
// r columns + c is (r, c).
struct GridSurface {
  const HeightGrid& grid;

  // Whether (r, c) is a vertex, for the neighbours of those at the border.
  bool has(std::int64_t r, std::int64_t c) const {
    return r >= 0 && r < grid.rows && c >= 0 && c < grid.columns;
  }
  double height(std::int64_t r, std::int64_t c) const { return grid.heights[r * grid.columns + c]; }
  Vec3 point(std::int64_t r, std::int64_t c) const {
    return {(static_cast<double>(c) / static_cast<double>(grid.columns - 1) - 0.5) * grid.size_x,
            (static_cast<double>(r) / static_cast<double>(grid.rows - 1) - 0.5) * grid.size_y, height(r, c)};
  }
  // Coordinates in cells: the vertex (r, c) has row_at = r and column_at = c.
  double column_at(double x) const { return (x / grid.size_x + 0.5) * static_cast<double>(grid.columns - 1); }
  double row_at(double y) const { return (y / grid.size_y + 0.5) * static_cast<double>(grid.rows - 1); }

  // The first and last index of the cells that [lower, upper] overlaps along one axis, `last` being the last
  // existing cell; is_beside() tells an interval outside the grid.
  static bool is_beside(double lower, double upper, std::int64_t last) {
    return !(upper >= 0 && lower <= static_cast<double>(last + 1));
  }
  static std::array<std::int64_t, 2> cells(double lower, double upper, std::int64_t last) {
    const auto cell = [&](double at) {
      return static_cast<std::int64_t>(std::clamp(std::floor(at), 0.0, static_cast<double>(last)));
    };
    return {cell(lower), cell(upper)};
  }

  // Triangles above the box by up to the box's own size count as near. The field is solid below its surface,
  // and a body that has sunk into it by at most its own height must still find the triangles over it.
  void for_each_near(const Aabb& box, auto&& visit) const {
    const double c0 = column_at(box.lower.x), c1 = column_at(box.upper.x);
    const double r0 = row_at(box.lower.y), r1 = row_at(box.upper.y);
    if (is_beside(c0, c1, grid.columns - 2) || is_beside(r0, r1, grid.rows - 2)) return;
    const Vec3 size = box.upper - box.lower;
    const double top = box.upper.z + std::max({size.x, size.y, size.z});
    if (grid.highest < box.lower.z || grid.lowest > top) return;
    const auto rows = cells(r0, r1, grid.rows - 2), columns = cells(c0, c1, grid.columns - 2);
    for (std::int64_t r = rows[0]; r <= rows[1]; ++r)
      for (std::int64_t c = columns[0]; c <= columns[1]; ++c) {
        const double a = height(r, c), d = height(r + 1, c + 1);
        for (int upper = 0; upper < 2; ++upper) {
          const double b = upper ? height(r + 1, c) : height(r, c + 1);
          if (std::max({a, b, d}) >= box.lower.z && std::min({a, b, d}) <= top)
            visit(2 * (r * (grid.columns - 1) + c) + upper);
        }
      }
  }

  using Site = std::array<std::int64_t, 2>;  // row and column
  std::array<Site, 3> corners(std::int64_t t) const {
    const std::int64_t r = t / 2 / (grid.columns - 1), c = t / 2 % (grid.columns - 1);
    if (t % 2) return {{{r, c}, {r + 1, c + 1}, {r + 1, c}}};
    return {{{r, c}, {r, c + 1}, {r + 1, c + 1}}};
  }

  // Triangle t without its neighbourhood, computed in every call from three heights.
  Facet facet(std::int64_t t) const {
    Facet f;
    const auto sites = corners(t);
    for (int k = 0; k < 3; ++k) {
      const auto [row, column] = sites[k];
      f.corner[k] = point(row, column);
      f.vertex[k] = row * grid.columns + column;
    }
    f.normal = normal_of(f.corner[0], f.corner[1], f.corner[2]);
    return f;
  }

  // Its neighbours follow from the pattern of cells: across its leg in the next cell, across the diagonal in
  // its own.
  void add_neighbours(std::int64_t t, Facet& f) const {
    const auto sites = corners(t);
    const auto [r, c] = sites[0];
    const Site opposite[2][3] = {{{r - 1, c}, {r + 1, c + 2}, {r + 1, c}},
                                 {{r, c + 1}, {r + 2, c + 1}, {r, c - 1}}};
    Vec3 corner[3];
    for (int k = 0; k < 3; ++k) corner[k] = point(sites[k][0], sites[k][1]);
    for (int k = 0; k < 3; ++k) {
      const auto [row, column] = opposite[t % 2][k];
      f.edge[k] = EdgeKind::border;
      f.opposite[k] = corner[k];
      if (!has(row, column)) continue;
      const Vec3 &a = corner[k], &b = corner[(k + 1) % 3];
      f.opposite[k] = point(row, column);
      f.edge[k] = edge_kind(a, b, f.normal, normal_of(b, a, f.opposite[k]), f.opposite[k]);
    }
  }

  // Upwards for corners that are counter-clockwise seen from above.
  static Vec3 normal_of(const Vec3& a, const Vec3& b, const Vec3& c) {
    return normalised(cross(b - a, c - a));
  }

  // The six vertices that edges join to (r, c), counter-clockwise: along the row and the column, and along
  // the two diagonals that end there.
  static constexpr int around[6][2] = {{0, 1}, {1, 1}, {1, 0}, {0, -1}, {-1, -1}, {-1, 0}};

  void for_each_neighbour(std::int64_t vertex, auto&& visit) const {
    const std::int64_t r = vertex / grid.columns, c = vertex % grid.columns;
    for (const auto& [dr, dc] : around)
      if (has(r + dr, c + dc)) visit(point(r + dr, c + dc));
  }

  bool is_active(std::int64_t vertex) const { return grid.is_active[vertex]; }

  // Whether one of the six edges at a vertex is not flat; edges on the border of the grid do not count. Edge
  // k is between the triangles (at, ring k, ring k + 1) and (at, ring k - 1, ring k).
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

  // Above the surface, or beside the rectangle, which has no ground.
  bool is_outside(const Vec3& p, std::int64_t, const TrianglePoint&) const {
    const double column = column_at(p.x), row = row_at(p.y);
    if (!(column >= 0 && row >= 0 && column <= static_cast<double>(grid.columns - 1) &&
          row <= static_cast<double>(grid.rows - 1)))
      return true;
    const auto r = std::min(static_cast<std::int64_t>(row), grid.rows - 2);
    const auto c = std::min(static_cast<std::int64_t>(column), grid.columns - 2);
    const double u = column - static_cast<double>(c), v = row - static_cast<double>(r);
    const double a = height(r, c), d = height(r + 1, c + 1);
    const double b = u > v ? height(r, c + 1) : height(r + 1, c);
    // Linear over the triangle a b d, where b is the corner on p's side of the diagonal u = v. It goes from a
    // by min(u, v) along the diagonal to d and by |u - v| along the leg to b.
    const double surface = a + std::min(u, v) * (d - a) + std::abs(u - v) * (b - a);
    return p.z > surface;
  }
};

}  // namespace collision
}  // namespace amontons
