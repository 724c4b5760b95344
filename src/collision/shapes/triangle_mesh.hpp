#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "amontons/collision/shapes/aabb.hpp"
#include "collision/shapes/facet.hpp"

// The derived data of a mesh. Contact with a triangle needs the neighbours across its edges and around its
// corners (see narrow/surface.hpp on active edges), and a body needs the few near triangles out of many.
// make_mesh() computes all of it once and stores it in flat arrays indexed by triangles and vertices.
namespace amontons {

struct TriangleMesh {
  using Triangle = std::array<std::int32_t, 3>;
  std::vector<Vec3> vertices;  // equal ones are merged: files often repeat them per triangle
  std::vector<Triangle> triangles;
  std::vector<Vec3> normals;         // of the triangles, unit
  std::vector<Triangle> neighbours;  // across edge k (from corner k to the next), -1 at a border
  std::vector<std::array<collision::EdgeKind, 3>> edges;

  // Per vertex: those that edges join to v are around[around_start[v]] to around[around_start[v + 1]].
  std::vector<std::int32_t> around_start, around;
  std::vector<Vec3> vertex_normals;                 // weighted by angles; not normalised
  std::vector<unsigned char> is_active, is_border;  // whether a non-flat edge ends there; a border

  // The tree over the triangles, parents first: the left child follows its parent.
  struct Node {
    Aabb box;
    std::int32_t first, count;  // for a leaf: a range of `order`; for others: count = 0, first = right child
  };
  std::vector<Node> nodes;
  std::vector<std::int32_t> order;

  // Corner k of triangle t; k is taken modulo 3, so that k + 1 and k + 2 are the other two.
  const Vec3& corner(std::size_t t, int k) const { return vertices[triangles[t][k % 3]]; }
};

namespace collision {

// The Surface for narrow/surface.hpp.
struct MeshSurface {
  const TriangleMesh& mesh;

  // Triangles in boxes of the tree that `enters` accepts. Depth first, left child first: in the order of
  // `order`.
  void for_each(auto&& enters, auto&& visit) const {
    // The halves of a split differ by at most one triangle: 64 levels exceed any memory.
    std::int32_t stack[64];
    int size = 0;
    stack[size++] = 0;
    while (size > 0) {
      const std::int32_t k = stack[--size];
      const TriangleMesh::Node& node = mesh.nodes[k];
      if (!enters(node.box)) continue;
      if (node.count == 0) {
        stack[size++] = node.first;
        stack[size++] = k + 1;
        continue;
      }
      for (std::int32_t i = node.first; i < node.first + node.count; ++i) visit(mesh.order[i]);
    }
  }
  void for_each_near(const Aabb& box, auto&& visit) const {
    for_each([&](const Aabb& around) { return is_overlap(around, box); },
             [&](std::int32_t t) {
               if (is_overlap(bounds_of(t), box)) visit(t);
             });
  }

  // Box of one triangle; computed when needed, because storing it would add a third to the memory of the
  // mesh.
  Aabb bounds_of(std::int32_t t) const {
    const Vec3 &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
    return {{std::min({a.x, b.x, c.x}), std::min({a.y, b.y, c.y}), std::min({a.z, b.z, c.z})},
            {std::max({a.x, b.x, c.x}), std::max({a.y, b.y, c.y}), std::max({a.z, b.z, c.z})}};
  }

  // The triangle without its neighbourhood, and the neighbourhood.
  Facet facet(std::int32_t t) const {
    Facet f;
    f.normal = mesh.normals[t];
    for (int k = 0; k < 3; ++k) {
      f.vertex[k] = mesh.triangles[t][k];
      f.corner[k] = mesh.corner(t, k);
    }
    return f;
  }
  void add_neighbours(std::int32_t t, Facet& f) const {
    for (int k = 0; k < 3; ++k) {
      f.edge[k] = mesh.edges[t][k];
      f.opposite[k] = mesh.corner(t, k);
      // The neighbour shares two corners; the third one is not on the edge.
      if (const std::int32_t other = mesh.neighbours[t][k]; other >= 0)
        for (std::int32_t v : mesh.triangles[other])
          if (v != mesh.triangles[t][k] && v != mesh.triangles[t][(k + 1) % 3])
            f.opposite[k] = mesh.vertices[v];
    }
  }

  void for_each_neighbour(std::int64_t vertex, auto&& visit) const {
    for (std::int32_t i = mesh.around_start[vertex]; i < mesh.around_start[vertex + 1]; ++i)
      visit(mesh.vertices[mesh.around[i]]);
  }

  // Whether an edge that is not flat ends at a vertex.
  bool is_active(std::int64_t vertex) const { return mesh.is_active[vertex]; }

  // By the normal at the closest point: of the face, the sum of two at an edge, weighted by angles at a
  // corner (J. A. Baerentzen and H. Aanaes, "Signed distance computation using the angle weighted
  // pseudonormal", 2005). Points beside the border of an open mesh count as outside.
  bool is_outside(const Vec3& p, std::int32_t t, const TrianglePoint& closest) const {
    const Vec3 to = p - closest.at;
    const unsigned feature = closest.feature;
    // Bits of the corners that hold the closest point: all three, one, or two, which name an edge.
    if (feature == 7) return dot(mesh.normals[t], to) > 0;
    if (feature == 1 || feature == 2 || feature == 4) {
      const std::int32_t v = mesh.triangles[t][feature == 1 ? 0 : feature == 2 ? 1 : 2];
      return mesh.is_border[v] || dot(mesh.vertex_normals[v], to) > 0;
    }
    const std::int32_t other = mesh.neighbours[t][feature == 3 ? 0 : feature == 6 ? 1 : 2];
    return other < 0 || dot(mesh.normals[t] + mesh.normals[other], to) > 0;
  }
};

}  // namespace collision
}  // namespace amontons
