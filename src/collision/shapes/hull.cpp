#include "amontons/collision/shapes/hull.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "amontons/base/error.hpp"

// A convex polyhedron from the triangles of its surface, in these steps:
//   1. check that the surface is closed, faces outwards and has a volume;
//   2. join coplanar triangles to faces, because a divided face would give the manifold of one triangle at a
//      time, and of another one as soon as the body rocks;
//   3. trace the rim of every face, and keep the points where at least three faces meet: the corners;
//   4. compute the planes of the faces again from their corners, and check that no corner is beyond one.
// The triangles may come from any convex hull program. The hull is not computed here from points alone, so
// that the geometry is the one that the user sees.
//
// A closed surface traverses every edge once in each direction. So a directed edge is identified by its ends,
// and the triangle beyond it is the one with the reverse edge.
namespace amontons {

namespace {

using Triangle = std::array<std::int32_t, 3>;
using Index = std::int32_t;

// A directed edge of a triangle, ordered by its ends: the edges that start at one vertex lie together.
struct HalfEdge {
  Index from, to, triangle;
};
bool operator<(const HalfEdge& a, const HalfEdge& b) {
  return a.from != b.from ? a.from < b.from : a.to < b.to;
}

// For messages: a triangle is given by its corners, which the user can find in a file.
std::string name_of(const Triangle& t) {
  return "(" + std::to_string(t[0]) + ", " + std::to_string(t[1]) + ", " + std::to_string(t[2]) + ")";
}

// Checks of the lists alone, before any geometry.
void check_input(std::span<const Vec3> vertices, std::span<const Triangle> triangles) {
  AMONTONS_REQUIRE(vertices.size() >= 4,
                   "convex hull: it needs at least four corners, not " + std::to_string(vertices.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i)
    AMONTONS_REQUIRE(is_finite(vertices[i]), "convex hull: vertex " + std::to_string(i) + " is not finite");
  for (const Triangle& t : triangles) {
    for (Index i : t)
      AMONTONS_REQUIRE(i >= 0 && static_cast<std::size_t>(i) < vertices.size(),
                       "convex hull: triangle " + name_of(t) +
                           " names a vertex that does not exist; there are " +
                           std::to_string(vertices.size()));
    AMONTONS_REQUIRE(t[0] != t[1] && t[1] != t[2] && t[0] != t[2],
                     "convex hull: triangle " + name_of(t) + " names a vertex twice; leave it out");
  }
  AMONTONS_REQUIRE(triangles.size() >= 4,
                   "convex hull: it needs at least four triangles, not " + std::to_string(triangles.size()));
}

// All directed edges, by their ends, so that opposite() finds one by bisection.
std::vector<HalfEdge> sorted_edges(std::span<const Triangle> triangles) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      edges.push_back({triangles[t][k], triangles[t][(k + 1) % 3], static_cast<Index>(t)});
  std::sort(edges.begin(), edges.end());
  return edges;
}

// The triangle on the other side of an edge.
Index opposite(const std::vector<HalfEdge>& edges, Index from, Index to) {
  const HalfEdge key{to, from, 0};
  const auto found = std::lower_bound(edges.begin(), edges.end(), key);
  return found != edges.end() && !(key < *found) ? found->triangle : -1;
}

// In the sorted list equal edges are adjacent. Every edge must occur once in each direction.
void check_closed(const std::vector<HalfEdge>& edges) {
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const HalfEdge& e = edges[i];
    const std::string edge = std::to_string(e.from) + " -> " + std::to_string(e.to);
    AMONTONS_REQUIRE(i == 0 || edges[i - 1] < e,
                     "convex hull: two triangles run along the edge " + edge +
                         " in the same direction; list every triangle once, counter-clockwise from outside");
    AMONTONS_REQUIRE(opposite(edges, e.from, e.to) >= 0,
                     "convex hull: the surface is open at the edge " + edge + "; close it, or use a mesh");
  }
}

// Twice the area of a triangle along its outward normal: its length ranks triangles, and its sums give
// volumes.
Vec3 area_vector(std::span<const Vec3> vertices, const Triangle& t) {
  const Vec3& a = vertices[t[0]];
  return cross(vertices[t[1]] - a, vertices[t[2]] - a);
}

// The indices of the triangles, the largest first. Equal ones keep their order, so that the result depends
// only on the input.
std::vector<Index> by_falling_area(std::span<const Vec3> vertices, std::span<const Triangle> triangles) {
  std::vector<double> squared;
  for (const Triangle& t : triangles) squared.push_back(norm_squared(area_vector(vertices, t)));
  std::vector<Index> order(triangles.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Index s, Index t) { return squared[s] > squared[t]; });
  return order;
}

// The face of every triangle. Triangles whose corners are within the tolerance of one plane are joined, from
// the largest on, so that needles, whose normals are rounding, never define a plane. The plane is that of the
// first, largest triangle, and does not follow those that join: a chain of small angles cannot bend a face
// around a corner.
std::vector<Index> group_coplanar(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
                                  const std::vector<HalfEdge>& edges, double tolerance, Index& groups) {
  std::vector<Index> group(triangles.size(), -1), front;
  groups = 0;
  for (Index seed : by_falling_area(vertices, triangles)) {
    if (group[seed] >= 0) continue;
    const Vec3 area = area_vector(vertices, triangles[seed]);
    AMONTONS_REQUIRE(norm_squared(area) > 0,
                     "convex hull: triangle " + name_of(triangles[seed]) + " is degenerate; leave it out");
    const Vec3 normal = normalised(area);
    const double offset = dot(normal, vertices[triangles[seed][0]]);
    // Floods the surface from the seed across edges within the seed's plane.
    const auto is_in_plane = [&](Index i) {
      return std::abs(dot(normal, vertices[i]) - offset) <= tolerance;
    };
    group[seed] = groups;
    front.assign(1, seed);
    while (!front.empty()) {
      const Triangle corners = triangles[front.back()];
      front.pop_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const Index next = opposite(edges, corners[k], corners[(k + 1) % 3]);
        const Triangle& t = triangles[next];
        if (group[next] >= 0 || !std::all_of(t.begin(), t.end(), is_in_plane)) continue;
        group[next] = groups;
        front.push_back(next);
      }
    }
    ++groups;
  }
  return group;
}

// The rim of every group, one loop of corners each, counter-clockwise like its triangles. An edge belongs to
// the rim if the triangle beyond it is in another group.
std::vector<std::vector<Index>> trace_rims(std::span<const Triangle> triangles,
                                           const std::vector<HalfEdge>& edges,
                                           const std::vector<Index>& group, Index groups) {
  std::vector<std::vector<HalfEdge>> rims(static_cast<std::size_t>(groups));
  for (const HalfEdge& e : edges) {
    // Sorted by `from`, as `edges` is.
    const Index own = group[e.triangle];
    if (group[opposite(edges, e.from, e.to)] != own) rims[own].push_back(e);
  }
  std::vector<std::vector<Index>> faces;
  for (const auto& rim : rims) {
    AMONTONS_REQUIRE(rim.size() >= 3, "convex hull: the body is flat; give it a thickness");
    // From the end of each edge along the only rim edge that starts there. If two start there (a pinched
    // face), or the loop closes before it has used all edges (a hole), the surface is not convex.
    std::vector<Index> loop;
    for (Index i = rim[0].from; loop.empty() || i != rim[0].from;) {
      const auto e = std::lower_bound(rim.begin(), rim.end(), HalfEdge{i, -1, 0});
      AMONTONS_REQUIRE(loop.size() < rim.size() && e != rim.end() && e->from == i,
                       "convex hull: the surface around vertex " + std::to_string(i) +
                           " is not that of a convex body; use its convex hull, or a mesh");
      loop.push_back(i);
      i = e->to;
    }
    AMONTONS_REQUIRE(loop.size() == rim.size(), "convex hull: the face of triangle " +
                                                    name_of(triangles[rim[0].triangle]) +
                                                    " has a hole; use the convex hull of the body");
    faces.push_back(std::move(loop));
  }
  return faces;
}

// Keeps the points that at least three faces share, in their order: the others are within a face or an edge.
// A sliver between two faces of a finely divided surface may keep only two points: it is an edge of both.
void keep_corners(std::span<const Vec3> vertices, std::vector<std::vector<Index>> faces, ConvexHull& hull) {
  // At a corner of a polyhedron at least three faces meet, at a point inside an edge two, inside a face one.
  std::vector<int> uses(vertices.size(), 0);
  for (const auto& face : faces)
    for (Index i : face) ++uses[i];
  std::vector<Index> number(vertices.size(), -1);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (uses[i] < 3) continue;
    number[i] = static_cast<Index>(hull.vertices.size());
    hull.vertices.push_back(vertices[i]);
  }
  for (auto& face : faces) {
    std::vector<Index> corners;
    for (Index i : face)
      if (number[i] >= 0) corners.push_back(number[i]);
    if (corners.size() >= 3) hull.faces.push_back(std::move(corners));
  }
  AMONTONS_REQUIRE(hull.faces.size() > 3, "convex hull: the body is flat; give it a thickness");
}

// The normal of a face is that of its area vector, a sum over the fan from its first corner, which small
// triangles of the fan cannot spoil. The offset is the largest of the corners', so that no corner is beyond
// it.
void set_planes(ConvexHull& hull) {
  for (const auto& face : hull.faces) {
    const Vec3& o = hull.vertices[face[0]];
    Vec3 area;
    for (std::size_t k = 2; k < face.size(); ++k)
      area += cross(hull.vertices[face[k - 1]] - o, hull.vertices[face[k]] - o);
    const Vec3 normal = normalised(area);
    double offset = dot(normal, o);
    for (Index i : face) offset = std::max(offset, dot(normal, hull.vertices[i]));
    hull.normals.push_back(normal);
    hull.offsets.push_back(offset);
  }
}

// Every edge belongs to two faces, which traverse it in opposite directions. So each corner has each of its
// neighbours once as the next corner of a face.
void set_neighbours(ConvexHull& hull) {
  hull.neighbours.resize(hull.vertices.size());
  for (const auto& face : hull.faces)
    for (std::size_t k = 0; k < face.size(); ++k)
      hull.neighbours[face[k]].push_back(face[(k + 1) % face.size()]);
  for (auto& list : hull.neighbours) std::sort(list.begin(), list.end());
}

// Directions by cells: six sides of a cube around the origin with `cells` x `cells` squares each.
// Number (count): more cells have shorter lists, but each face is then in more of them, 20 with these. An odd
// number has the axes, along which flat sides lie, in the middle of cells.
constexpr int cells = 9;
// Size (faces): with fewer a pass over all is as fast as the table.
constexpr std::size_t few_faces = 24;

std::size_t cell_of(const Vec3& d) {
  int side = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(d[i]) > std::abs(d[side])) side = i;
  const double size = std::abs(d[side]);
  const auto place = [&](double c) {
    return std::clamp(static_cast<int>((0.5 * cells) * (c / size + 1)), 0, cells - 1);
  };
  const int u = place(d[(side + 1) % 3]), v = place(d[(side + 2) % 3]);
  return static_cast<std::size_t>(((d[side] < 0 ? side + 3 : side) * cells + u) * cells + v);
}

// The middle of a cell, and its corners: unit vectors.
std::array<Vec3, 5> outline_of_cell(int cell) {
  const int side = cell / (cells * cells), u = cell / cells % cells, v = cell % cells;
  const auto direction = [&](double du, double dv) {
    Vec3 d;
    d[side % 3] = side < 3 ? 1 : -1;
    d[(side + 1) % 3] = 2 * (u + du) / cells - 1;
    d[(side + 2) % 3] = 2 * (v + dv) / cells - 1;
    return normalised(d);
  };
  return {direction(0.5, 0.5), direction(0, 0), direction(0, 1), direction(1, 0), direction(1, 1)};
}

// The extreme corner along the middle of each cell.
void set_starts(ConvexHull& hull) {
  for (int cell = 0; cell < 6 * cells * cells; ++cell) {
    const Vec3 d = outline_of_cell(cell)[0];
    std::int32_t best = 0;
    for (std::size_t k = 1; k < hull.vertices.size(); ++k)
      if (dot(hull.vertices[k], d) > dot(hull.vertices[best], d)) best = static_cast<std::int32_t>(k);
    hull.start.push_back(best);
  }
}

// A cell lists the faces whose normals are near its middle. The largest angle is that of face_cosine plus
// that from the middle to the farthest corner, by cos(a + b) = cos a cos b - sin a sin b.
void set_facing(ConvexHull& hull) {
  if (hull.faces.size() <= few_faces) {
    hull.facing.resize(hull.faces.size());
    std::iota(hull.facing.begin(), hull.facing.end(), 0);
    return;
  }
  const auto sine = [](double cosine) { return std::sqrt(std::max(0.0, 1 - cosine * cosine)); };
  hull.facing_start.assign(1, 0);
  for (int cell = 0; cell < 6 * cells * cells; ++cell) {
    const auto outline = outline_of_cell(cell);
    double nearest = 1;
    for (const Vec3& corner : outline) nearest = std::min(nearest, dot(corner, outline[0]));
    const double least = nearest * face_cosine - sine(nearest) * sine(face_cosine) - 1e-9;
    for (std::size_t f = 0; f < hull.normals.size(); ++f)
      if (dot(hull.normals[f], outline[0]) >= least) hull.facing.push_back(static_cast<std::int32_t>(f));
    hull.facing_start.push_back(static_cast<std::int32_t>(hull.facing.size()));
  }
}

// No corner may be beyond any face, up to the shift of the planes by merging coplanar triangles. Every point
// being behind every face is the definition of convexity; testing across edges alone would accept surfaces
// that wind around twice.
void check_convex(const ConvexHull& hull, double tolerance) {
  for (std::size_t f = 0; f < hull.faces.size(); ++f)
    for (const Vec3& p : hull.vertices)
      AMONTONS_REQUIRE(dot(hull.normals[f], p) <= hull.offsets[f] + tolerance,
                       "convex hull: the body is not convex at the face with normal (" +
                           std::to_string(hull.normals[f].x) + ", " + std::to_string(hull.normals[f].y) +
                           ", " + std::to_string(hull.normals[f].z) + "); use its convex hull, or split it");
}

// By the divergence theorem the volume is that of the tetrahedra from any point to every triangle,
//   V = sum <a - centre, (b - a) x (c - a)> / 6,
// positive for outward triangles; from the centre of the corners rounding is least. A volume below 1e-9 of
// the cubed size is that of a flat body, with sides of 1e-9 of its length, whose normals are rounding.
// Returns the size: the distance of the farthest corner from the centre.
double check_volume(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
                    const std::vector<HalfEdge>& edges) {
  Vec3 centre;
  for (const HalfEdge& e : edges) centre += vertices[e.from];
  centre = centre / static_cast<double>(edges.size());
  double size = 0, volume = 0;
  for (const HalfEdge& e : edges) size = std::max(size, norm(vertices[e.from] - centre));
  for (const Triangle& t : triangles) volume += dot(vertices[t[0]] - centre, area_vector(vertices, t)) / 6;
  AMONTONS_REQUIRE(std::abs(volume) > 1e-9 * size * size * size,
                   "convex hull: the body is flat; give it a thickness");
  AMONTONS_REQUIRE(volume > 0, "convex hull: the triangles face inwards; reverse the order of their corners");
  return size;
}

}  // namespace

// Tests all corners, or for large hulls climbs along the edges: a local maximum of a linear function on a
// convex body is the maximum. The walk begins at the corner for a direction nearby, because each of its steps
// has a cache miss and comparisons.
std::int32_t extreme_corner(const ConvexHull& hull, const Vec3& direction) {
  const bool walks = hull.vertices.size() > few_corners;
  std::int32_t best = walks ? hull.start[cell_of(direction)] : 0;
  double height = dot(hull.vertices[best], direction);
  const auto climbs_to = [&](std::int32_t i) {
    const double h = dot(hull.vertices[i], direction);
    if (!(h > height)) return false;
    height = h;
    best = i;
    return true;
  };
  if (!walks) {
    // For few corners a linear pass through memory is faster than the walk.
    for (std::size_t i = 1; i < hull.vertices.size(); ++i) climbs_to(static_cast<std::int32_t>(i));
    return best;
  }
  for (bool higher = true; higher;) {
    higher = false;
    for (std::int32_t j : hull.neighbours[best]) higher |= climbs_to(j);
  }
  return best;
}

std::span<const std::int32_t> faces_towards(const ConvexHull& hull, const Vec3& direction) {
  if (hull.facing_start.empty()) return hull.facing;
  const std::size_t cell = cell_of(direction);
  const auto first = static_cast<std::size_t>(hull.facing_start[cell]);
  return std::span(hull.facing).subspan(first, static_cast<std::size_t>(hull.facing_start[cell + 1]) - first);
}

Hull make_hull(std::span<const Vec3> vertices, std::span<const Triangle> triangles) {
  check_input(vertices, triangles);
  const std::vector<HalfEdge> edges = sorted_edges(triangles);
  check_closed(edges);
  const double size = check_volume(vertices, triangles, edges);
  // Coordinates in single precision, as in many files, leave flat faces flat to about 1e-7 of their size: ten
  // times that counts as flat. A corner may be outside by the tolerance of two planes.
  const double tolerance = 1e-6 * size;
  Index groups = 0;
  const std::vector<Index> group = group_coplanar(vertices, triangles, edges, tolerance, groups);
  auto hull = std::make_shared<ConvexHull>();
  keep_corners(vertices, trace_rims(triangles, edges, group, groups), *hull);
  set_planes(*hull);
  set_neighbours(*hull);
  set_starts(*hull);
  set_facing(*hull);
  for (const Vec3& p : hull->vertices) {
    include(hull->box, p);
    hull->radius = std::max(hull->radius, norm(p));
    hull->middle += p / static_cast<double>(hull->vertices.size());
  }
  // Tolerances of the narrow phase are relative to it.
  hull->extent = 0.5 * norm(hull->box.upper - hull->box.lower);
  check_convex(*hull, 4 * tolerance);
  hull->given_vertices.assign(vertices.begin(), vertices.end());
  hull->given_triangles.assign(triangles.begin(), triangles.end());
  return {std::move(hull)};
}

}  // namespace amontons
