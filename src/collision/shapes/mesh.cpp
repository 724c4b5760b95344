#include "amontons/collision/shapes/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <compare>
#include <numbers>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

#include "amontons/base/elementary.hpp"
#include "amontons/base/error.hpp"
#include "collision/shapes/triangle_mesh.hpp"

// make_mesh() checks the mesh and computes once which triangles are adjacent, which edges and vertices are
// convex, and a tree of boxes over the triangles. Its steps:
//   1. weld vertices at one place, so that triangles share them;
//   2. normals; degenerate triangles are rejected;
//   3. per edge the neighbour across it and the dihedral angle, as flat, convex, concave or border: only
//      convex and border edges have contact normals other than the face's (narrow/surface.hpp);
//   4. per vertex whether any such edge ends there, its neighbours, and a normal that separates inside from
//      outside;
//   5. the tree.
// Meshes of files are rarely perfect. Open borders, edges of more than two triangles and unused vertices are
// allowed; only data that is no surface is rejected, by name.
namespace amontons {
namespace {

using Triangle = TriangleMesh::Triangle;

// For messages: the index of a triangle in the input.
std::string name_of(std::size_t t) { return "triangle mesh: triangle " + std::to_string(t); }

// Checks before any geometry.
void check(std::span<const Vec3> vertices, std::span<const Triangle> triangles) {
  AMONTONS_REQUIRE(!triangles.empty(), "triangle mesh: it has no triangle");
  for (std::size_t i = 0; i < vertices.size(); ++i)
    AMONTONS_REQUIRE(is_finite(vertices[i]), "triangle mesh: vertex " + std::to_string(i) + " is not finite");
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::int32_t i : triangles[t])
      AMONTONS_REQUIRE(i >= 0 && static_cast<std::size_t>(i) < vertices.size(),
                       name_of(t) + " names vertex " + std::to_string(i) + ", but there are " +
                           std::to_string(vertices.size()));
}

// Step 1. Vertices at the same place become the first of them, so that triangles of files that repeat
// vertices (STL) find their neighbours. Only equal coordinates are welded: a tolerance would have to guess
// the size of details.
void weld(std::span<const Vec3> vertices, std::span<const Triangle> triangles, TriangleMesh& mesh) {
  std::vector<std::int32_t> by_place(vertices.size()), first(vertices.size());
  std::iota(by_place.begin(), by_place.end(), 0);
  const auto key = [&](std::int32_t i) { return std::tuple(vertices[i].x, vertices[i].y, vertices[i].z, i); };
  std::sort(by_place.begin(), by_place.end(),
            [&](std::int32_t i, std::int32_t j) { return key(i) < key(j); });
  for (std::size_t k = 0; k < by_place.size(); ++k) {
    const std::int32_t i = by_place[k];
    first[i] = k > 0 && vertices[by_place[k - 1]] == vertices[i] ? first[by_place[k - 1]] : i;
  }
  mesh.vertices.assign(vertices.begin(), vertices.end());
  for (const Triangle& t : triangles) mesh.triangles.push_back({first[t[0]], first[t[1]], first[t[2]]});
}

// Step 2. The unit normal of every triangle, right-handed over its corners.
void find_normals(TriangleMesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 &a = mesh.corner(t, 0), ab = mesh.corner(t, 1) - a, ac = mesh.corner(t, 2) - a;
    // Scaled before the product, so that it does not underflow in any unit.
    const double length = std::sqrt(std::max({dot(ab, ab), dot(ac, ac), norm_squared(ac - ab)}));
    const Vec3 normal = length > 0 ? cross(ab / length, ac / length) : Vec3{};
    // A height of 1e-12 of the longest edge is rounding: such a triangle has no normal.
    AMONTONS_REQUIRE(norm(normal) > 1e-12,
                     name_of(t) + " is degenerate (its corners lie on a line); leave it out");
    mesh.normals.push_back(normalised(normal));
  }
}

// Edge k of a triangle, identified by its ends. When sorted by them, the edges that several triangles share
// are adjacent.
struct SharedEdge {
  std::int32_t low, high, triangle, k;
  bool up;  // from low to high
  auto operator<=>(const SharedEdge&) const = default;
};

// The angle through the outside from triangle e to triangle other about their common edge, in (0, 2 pi]. In
// the plane across the edge `inward` points into triangle e and its normal n to the outside. The third corner
// of the other triangle is therefore at atan2(<n, to>, <inward, to>).
double outer_angle(const TriangleMesh& mesh, const SharedEdge& e, const SharedEdge& other) {
  const Vec3 &a = mesh.corner(e.triangle, e.k), &b = mesh.corner(e.triangle, e.k + 1);
  const Vec3 &n = mesh.normals[e.triangle], inward = cross(n, normalised(b - a));
  const Vec3 to = mesh.corner(other.triangle, other.k + 2) - a;
  const double angle = elementary::atan2(dot(n, to), dot(inward, to));
  // The back of a sheet coincides with its front: the angle is 2 pi, not 0.
  return angle > 1e-9 ? angle : angle + 2 * std::numbers::pi;
}

// All edges, those with the same ends adjacent. Sorting replaces a hash table of edges: no allocation per
// edge, and an order that depends only on the mesh.
std::vector<SharedEdge> edges_by_ends(const TriangleMesh& mesh) {
  std::vector<SharedEdge> edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::int32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(t), k, a < b});
    }
  std::sort(edges.begin(), edges.end());
  return edges;
}

// Sets the neighbour of triangle e across its edge, and the kind of that edge, from `shared`: all edges with
// the same ends. If more than two triangles meet at an edge, neighbours are those that bound the same
// outside: the first one found on the way around the edge through the outside.
void set_neighbour(TriangleMesh& mesh, const SharedEdge& e, std::span<const SharedEdge> shared) {
  const SharedEdge* best = nullptr;
  double best_angle = 0;
  for (const SharedEdge& other : shared) {
    if (other.up == e.up) continue;  // from the same outside it would have the other direction
    const double angle = outer_angle(mesh, e, other);
    if (best && !(angle < best_angle)) continue;
    best = &other;
    best_angle = angle;
  }
  mesh.edges[e.triangle][e.k] = collision::EdgeKind::border;
  if (!best) return;
  mesh.neighbours[e.triangle][e.k] = best->triangle;
  mesh.edges[e.triangle][e.k] = collision::edge_kind(
      mesh.corner(e.triangle, e.k), mesh.corner(e.triangle, e.k + 1), mesh.normals[e.triangle],
      mesh.normals[best->triangle], mesh.corner(best->triangle, best->k + 2));
}

// Step 3. The neighbour across every edge, and the kind of the edge. Two triangles with the same direction
// along it have opposite sides outside.
void find_neighbours(TriangleMesh& mesh) {
  const std::vector<SharedEdge> edges = edges_by_ends(mesh);
  mesh.neighbours.assign(mesh.triangles.size(), {-1, -1, -1});
  mesh.edges.assign(mesh.triangles.size(), {});
  for (auto first = edges.begin(); first != edges.end();) {
    const auto last = std::find_if(first, edges.end(), [&](const SharedEdge& e) {
      return e.low != first->low || e.high != first->high;
    });
    AMONTONS_REQUIRE(
        last - first != 2 || first->up != first[1].up,
        name_of(static_cast<std::size_t>(first->triangle)) + " and triangle " +
            std::to_string(first[1].triangle) +
            " run along their common edge in the same direction; list the corners of all triangles "
            "counter-clockwise seen from outside");
    // From pointers: older C++ libraries make no span of iterators.
    const std::span shared(&*first, static_cast<std::size_t>(last - first));
    for (const SharedEdge& e : shared) set_neighbour(mesh, e, shared);
    first = last;
  }
}

// Step 4. The normal of a vertex is the sum of those of its triangles, weighted by their angles there. The
// sign of a point's distance from the vertex along it is right whenever the vertex is the closest point of a
// closed mesh (Baerentzen and Aanaes, 2005).
void describe_vertices(TriangleMesh& mesh) {
  const std::size_t n = mesh.vertices.size();
  mesh.vertex_normals.assign(n, {});
  mesh.is_active.assign(n, 0);
  mesh.is_border.assign(n, 0);
  std::vector<std::pair<std::int32_t, std::int32_t>> joined;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::int32_t v = mesh.triangles[t][k], next = mesh.triangles[t][(k + 1) % 3];
      joined.emplace_back(v, next);
      joined.emplace_back(next, v);
      const Vec3 a = normalised(mesh.corner(t, k + 1) - mesh.corner(t, k));
      const Vec3 b = normalised(mesh.corner(t, k + 2) - mesh.corner(t, k));
      mesh.vertex_normals[v] += elementary::atan2(norm(cross(a, b)), dot(a, b)) * mesh.normals[t];
      const collision::EdgeKind kind = mesh.edges[t][k];
      for (std::int32_t end : {v, next}) {
        mesh.is_active[end] |= kind != collision::EdgeKind::flat;
        mesh.is_border[end] |= kind == collision::EdgeKind::border;
      }
    }
  // Sorted by vertex, the neighbours of each vertex are contiguous; an edge of two triangles occurs twice.
  std::sort(joined.begin(), joined.end());
  joined.erase(std::unique(joined.begin(), joined.end()), joined.end());
  mesh.around_start.assign(n + 1, 0);
  for (const auto& [v, other] : joined) {
    ++mesh.around_start[v + 1];
    mesh.around.push_back(other);
  }
  for (std::size_t v = 0; v < n; ++v) mesh.around_start[v + 1] += mesh.around_start[v];
}

// Step 5. A node over order[first, last), and below it the halves, split at the median of the centres along
// their longest extent. The tree is balanced, and boxes of siblings overlap little. Leaves have up to four
// triangles: testing a few more boxes costs less than another level. Within a half the triangles keep their
// order.
void build_tree(TriangleMesh& mesh, const std::vector<Vec3>& centres, std::int32_t first, std::int32_t last) {
  Aabb box = empty_box(), middle = empty_box();
  for (std::int32_t i = first; i < last; ++i) {
    for (std::int32_t v : mesh.triangles[mesh.order[i]]) include(box, mesh.vertices[v]);
    include(middle, centres[mesh.order[i]]);
  }
  const std::size_t node = mesh.nodes.size();
  mesh.nodes.push_back({box, first, last - first});
  if (last - first <= 4) return;
  const Vec3 d = middle.upper - middle.lower;
  const int axis = d.x >= d.y && d.x >= d.z ? 0 : d.y >= d.z ? 1 : 2;
  const std::int32_t half = first + (last - first) / 2;
  // Ties by number: the tree, and with it the order of the contact points, depends only on the mesh.
  std::nth_element(mesh.order.begin() + first, mesh.order.begin() + half, mesh.order.begin() + last,
                   [&](std::int32_t a, std::int32_t b) {
                     return std::pair(centres[a][axis], a) < std::pair(centres[b][axis], b);
                   });
  std::sort(mesh.order.begin() + first, mesh.order.begin() + half);
  std::sort(mesh.order.begin() + half, mesh.order.begin() + last);
  build_tree(mesh, centres, first, half);
  mesh.nodes[node].first = static_cast<std::int32_t>(mesh.nodes.size());
  mesh.nodes[node].count = 0;
  build_tree(mesh, centres, half, last);
}

}  // namespace

Mesh make_mesh(std::span<const Vec3> vertices, std::span<const std::array<std::int32_t, 3>> triangles) {
  check(vertices, triangles);
  auto mesh = std::make_shared<TriangleMesh>();
  weld(vertices, triangles, *mesh);
  find_normals(*mesh);
  find_neighbours(*mesh);
  describe_vertices(*mesh);
  std::vector<Vec3> centres;
  for (const Triangle& t : mesh->triangles)
    centres.push_back((mesh->vertices[t[0]] + mesh->vertices[t[1]] + mesh->vertices[t[2]]) / 3);
  mesh->order.resize(triangles.size());
  std::iota(mesh->order.begin(), mesh->order.end(), 0);
  build_tree(*mesh, centres, 0, static_cast<std::int32_t>(triangles.size()));
  return {std::move(mesh)};
}

// Views of the data of the mesh, which live as long as a copy of the mesh does.
std::span<const Vec3> vertices_of(const Mesh& mesh) { return mesh.data->vertices; }
std::span<const std::array<std::int32_t, 3>> triangles_of(const Mesh& mesh) { return mesh.data->triangles; }

}  // namespace amontons
