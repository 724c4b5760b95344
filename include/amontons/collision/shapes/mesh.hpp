#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "amontons/collision/shapes/aabb.hpp"

namespace amontons {

// Static triangles, counter-clockwise seen from outside. Contact is from the outside only, so the mesh may be
// open. make_mesh() computes the edge data of the narrow phase and the tree over the triangles once; copies
// share them. Moving bodies use hulls instead: an open mesh has no inside to be pushed out of, and the cost
// grows with the number of near triangles.
struct TriangleMesh;
struct Mesh {
  std::shared_ptr<const TriangleMesh> data;
};

// Throws InputError naming the error: no triangle, degenerate triangles, indices out of range, two triangles
// that traverse their common edge in the same direction.
Mesh make_mesh(std::span<const Vec3> vertices, std::span<const std::array<std::int32_t, 3>> triangles);
// The surface as it is kept: equal vertices are one.
std::span<const Vec3> vertices_of(const Mesh& mesh);
std::span<const std::array<std::int32_t, 3>> triangles_of(const Mesh& mesh);

}  // namespace amontons
