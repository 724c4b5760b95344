#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "amontons/collision/pairs/collide.hpp"
#include "collision/narrow/surface.hpp"

namespace amontons {

struct TriangleMesh {
  using Triangle = std::array<std::int32_t, 3>;
  std::vector<Vec3> vertices;  // equal ones are one vertex: files often repeat them per triangle
  std::vector<Triangle> triangles;
  std::vector<Vec3> normals;         // of the triangles, unit
  std::vector<Triangle> neighbours;  // across edge k (from corner k to the next), -1 at a border
  std::vector<std::array<collision::EdgeKind, 3>> edges;

  // Of the vertices: those joined to v are around[around_start[v]] to around[around_start[v + 1]].
  std::vector<std::int32_t> around_start, around;
  std::vector<Vec3> vertex_normals;  // weighted by angles; their length means nothing
  std::vector<unsigned char> is_active, is_border;

  // The tree over the triangles, parents first: the left child follows its parent.
  struct Node {
    Aabb box;
    std::int32_t first, count;  // of a leaf: a range of `order`; of others: count = 0, first = right child
  };
  std::vector<Node> nodes;
  std::vector<std::int32_t> order;
};

namespace collision {

// Appends the contact points of a mesh with a convex shape; the normals point from the mesh to the shape.
void collide_mesh(const TriangleMesh& mesh, const Transform& frame_mesh, const Shape& convex,
                  const Transform& frame_convex, double margin, std::vector<ContactPoint>& points);

Aabb local_bounds(const TriangleMesh& mesh);

}  // namespace collision
}  // namespace amontons
