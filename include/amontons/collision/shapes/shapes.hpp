#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "amontons/base/math.hpp"

namespace amontons {

// The shapes, each in its own frame with its centre at the origin; lengths in m.
struct Sphere {
  double radius;
};
struct Box {
  Vec3 half;  // half edge lengths
};
struct Capsule {  // the points within `radius` of the segment |z| <= half_length
  double radius, half_length;
};
struct Cylinder {  // about the z axis, |z| <= half_length
  double radius, half_length;
};
struct Ellipsoid {
  Vec3 radii;  // semi-axes along x, y, z
};
struct Plane {};  // the half space z <= 0; its normal is +z. Static.

// A convex polyhedron: the corners and, per face, their indices counter-clockwise seen from outside. Coplanar
// triangles are merged into one face, so that manifolds are complete.
struct ConvexHull {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::int32_t>> faces;
  std::vector<Vec3> normals;                          // one per face, unit, outwards
  std::vector<double> offsets;                        // face f is { p : <normals[f], p> = offsets[f] }
  std::vector<std::vector<std::int32_t>> neighbours;  // per vertex: those joined to it by an edge, ascending
  double extent = 0;                                  // half the diagonal of the box around it
};
struct Hull {
  std::shared_ptr<const ConvexHull> data;
};

// Static triangles, counter-clockwise seen from outside; contact from the outside only. What the narrow phase
// needs of edges and the tree over the triangles are made once, by make_mesh().
struct TriangleMesh;
struct Mesh {
  std::shared_ptr<const TriangleMesh> data;
};
// A static grid of heights over the rectangle centred at the origin: row r, column c lies at
// x = (c / (columns - 1) - 1/2) size_x, y = (r / (rows - 1) - 1/2) size_y, z = heights[r * columns + c]; two
// triangles a cell. Contact from above only.
struct HeightGrid;
struct HeightField {
  std::shared_ptr<const HeightGrid> data;
};

using Shape = std::variant<Sphere, Box, Capsule, Cylinder, Ellipsoid, Plane, Hull, Mesh, HeightField>;

// Throw InputError naming what is wrong: sizes that are not positive and finite, fewer than four corners,
// triangles that do not close to a convex body, flat or degenerate triangles, indices out of range.
void validate(const Shape& shape);
Hull make_hull(std::span<const Vec3> vertices, std::span<const std::array<std::int32_t, 3>> triangles);
Mesh make_mesh(std::span<const Vec3> vertices, std::span<const std::array<std::int32_t, 3>> triangles);
HeightField make_height_field(std::span<const double> heights, std::size_t rows, std::size_t columns,
                              double size_x, double size_y);

// Only fixed bodies may carry these: planes, meshes and height fields.
bool is_static_only(const Shape& shape);
// The radius of the sphere about the origin of the shape that holds it; infinite for a plane.
double bounding_radius(const Shape& shape);

struct Aabb {
  Vec3 lower, upper;
};
// The axis-aligned box around the shape in world coordinates; infinite for a plane.
Aabb bounds(const Shape& shape, const Transform& frame);

}  // namespace amontons
