#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "amontons/collision/shapes/aabb.hpp"

namespace amontons {

// Static triangles, counter-clockwise seen from outside; contact from the outside only, so that the mesh may
// be open. What the narrow phase needs of edges and the tree over the triangles are made once, by
// make_mesh(). Copies share them. Convex bodies that move are hulls instead: a mesh has no inside to be
// pushed out of where it is open, and its contacts cost as much as there are triangles near.
struct TriangleMesh;
struct Mesh {
  std::shared_ptr<const TriangleMesh> data;
};

// Throws InputError naming what is wrong: no triangle, degenerate triangles, indices out of range, two
// triangles that run along their common edge in the same direction.
Mesh make_mesh(std::span<const Vec3> vertices, std::span<const std::array<std::int32_t, 3>> triangles);

}  // namespace amontons
