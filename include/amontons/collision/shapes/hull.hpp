#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "amontons/collision/shapes/aabb.hpp"

namespace amontons {

// A convex polyhedron: the corners and, per face, their indices counter-clockwise seen from outside. Coplanar
// triangles are merged into one face, so that manifolds are complete: a box given by twelve triangles rests
// on four corners, not on the three of one triangle. Coordinates are in the shape's frame, in m; its origin
// may be anywhere.
struct ConvexHull {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::int32_t>> faces;
  std::vector<Vec3> normals;                          // one per face, unit, outwards
  std::vector<double> offsets;                        // face f is { p : <normals[f], p> = offsets[f] }
  std::vector<std::vector<std::int32_t>> neighbours;  // per vertex: those joined to it by an edge, ascending
  std::vector<std::int32_t> start;                    // extreme corners by direction, for extreme_corner
  std::vector<std::int32_t> facing, facing_start;     // faces by direction (faces_towards)
  Vec3 middle;                                        // the mean of the corners, inside
  double extent = 0;                                  // half the diagonal of the box around it
  double radius = 0;                                  // of the sphere about the origin that contains it
  Aabb box = empty_box();                             // around it, in its own axes
  // The arguments of make_hull(). Files hold them, so that a hull from a file is the same to the last bit.
  // The order of the triangles decides that of the faces, and the order of the faces that of contact points.
  std::vector<Vec3> given_vertices;
  std::vector<std::array<std::int32_t, 3>> given_triangles;
};
// Size (corners): in a hull with more a walk along edges is faster than a pass over all corners.
constexpr std::size_t few_corners = 48;
// The extreme corner along a direction, of any nonzero length.
std::int32_t extreme_corner(const ConvexHull& hull, const Vec3& direction);

// A face supports a direction if the cosine between its normal and the direction exceeds this (18 degrees).
// With a larger tilt a face leaves the margin before it matters, and a clipped sliver of a steep face is no
// contact area.
constexpr double face_cosine = 0.95;
// The faces that may support a direction, ascending, from a table of cells of directions: every face whose
// normal is that near to some direction of the cell. A hull of few faces has one cell with all of them.
std::span<const std::int32_t> faces_towards(const ConvexHull& hull, const Vec3& direction);

// The shape that bodies carry; copies share the polyhedron, which never changes.
struct Hull {
  std::shared_ptr<const ConvexHull> data;
};

// Throws InputError naming the error: fewer than four corners, triangles that do not form a closed convex
// body or that face inwards, degenerate triangles, indices out of range.
Hull make_hull(std::span<const Vec3> vertices, std::span<const std::array<std::int32_t, 3>> triangles);

}  // namespace amontons
