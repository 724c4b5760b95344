#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/base/error.hpp"
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

namespace {

using Triangle = std::array<std::int32_t, 3>;
using Index = std::int32_t;

// A directed edge of a triangle.
struct HalfEdge {
  Index from, to, triangle;
};
bool operator<(const HalfEdge& a, const HalfEdge& b) {
  return a.from != b.from ? a.from < b.from : a.to < b.to;
}

std::string name_of(const Triangle& t) {
  return "(" + std::to_string(t[0]) + ", " + std::to_string(t[1]) + ", " + std::to_string(t[2]) + ")";
}
const Vec3& at(std::span<const Vec3> vertices, Index i) { return vertices[static_cast<std::size_t>(i)]; }

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
}

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

Vec3 area_vector(std::span<const Vec3> vertices, const Triangle& t) {
  const Vec3& a = at(vertices, t[0]);
  return cross(at(vertices, t[1]) - a, at(vertices, t[2]) - a);
}

// The face of every triangle: triangles whose corners lie within the tolerance of one plane, joined from the
// largest on, so that needles never set a plane.
std::vector<Index> group_coplanar(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
                                  const std::vector<HalfEdge>& edges, double tolerance, Index& groups) {
  std::vector<Vec3> areas(triangles.size());
  std::vector<Index> order(triangles.size()), group(triangles.size(), -1), front;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    areas[t] = area_vector(vertices, triangles[t]);
    order[t] = static_cast<Index>(t);
  }
  std::stable_sort(order.begin(), order.end(), [&](Index s, Index t) {
    return norm_squared(areas[static_cast<std::size_t>(s)]) >
           norm_squared(areas[static_cast<std::size_t>(t)]);
  });
  groups = 0;
  for (Index seed : order) {
    if (group[static_cast<std::size_t>(seed)] >= 0) continue;
    const Vec3 area = areas[static_cast<std::size_t>(seed)];
    AMONTONS_REQUIRE(norm_squared(area) > 0, "convex hull: triangle " +
                                                 name_of(triangles[static_cast<std::size_t>(seed)]) +
                                                 " is degenerate; leave it out");
    const Vec3 normal = normalised(area);
    const double offset = dot(normal, at(vertices, triangles[static_cast<std::size_t>(seed)][0]));
    const auto coplanar = [&](Index t) {
      const Triangle& corners = triangles[static_cast<std::size_t>(t)];
      return std::all_of(corners.begin(), corners.end(), [&](Index i) {
        return std::abs(dot(normal, at(vertices, i)) - offset) <= tolerance;
      });
    };
    group[static_cast<std::size_t>(seed)] = groups;
    front.assign(1, seed);
    while (!front.empty()) {
      const Triangle corners = triangles[static_cast<std::size_t>(front.back())];
      front.pop_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const Index next = opposite(edges, corners[k], corners[(k + 1) % 3]);
        if (group[static_cast<std::size_t>(next)] >= 0 || !coplanar(next)) continue;
        group[static_cast<std::size_t>(next)] = groups;
        front.push_back(next);
      }
    }
    ++groups;
  }
  return group;
}

// The rim of every group, as one loop of corners each.
std::vector<std::vector<Index>> trace_rims(std::span<const Triangle> triangles,
                                           const std::vector<HalfEdge>& edges,
                                           const std::vector<Index>& group, Index groups) {
  std::vector<std::vector<HalfEdge>> rims(static_cast<std::size_t>(groups));
  for (const HalfEdge& e : edges) {
    const Index own = group[static_cast<std::size_t>(e.triangle)];
    if (group[static_cast<std::size_t>(opposite(edges, e.from, e.to))] != own)
      rims[static_cast<std::size_t>(own)].push_back(e);  // sorted by `from`, as `edges` is
  }
  std::vector<std::vector<Index>> faces;
  for (const auto& rim : rims) {
    AMONTONS_REQUIRE(rim.size() >= 3, "convex hull: the body is flat; give it a thickness");
    std::vector<Index> loop;
    for (Index i = rim[0].from; loop.empty() || i != rim[0].from;) {
      const auto e = std::lower_bound(rim.begin(), rim.end(), HalfEdge{i, -1, 0});
      AMONTONS_REQUIRE(loop.size() < rim.size() && e != rim.end() && e->from == i,
                       "convex hull: the surface around vertex " + std::to_string(i) +
                           " is not that of a convex body; use its convex hull, or a mesh");
      loop.push_back(i);
      i = e->to;
    }
    AMONTONS_REQUIRE(loop.size() == rim.size(),
                     "convex hull: the face of triangle " +
                         name_of(triangles[static_cast<std::size_t>(rim[0].triangle)]) +
                         " has a hole; use the convex hull of the body");
    faces.push_back(std::move(loop));
  }
  return faces;
}

// Keeps the points that at least three faces share, in their order: the others lie within a face or an edge.
void keep_corners(std::span<const Vec3> vertices, std::vector<std::vector<Index>> faces, ConvexHull& hull) {
  std::vector<int> uses(vertices.size(), 0);
  for (const auto& face : faces)
    for (Index i : face) ++uses[static_cast<std::size_t>(i)];
  std::vector<Index> number(vertices.size(), -1);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (uses[i] < 3) continue;
    number[i] = static_cast<Index>(hull.vertices.size());
    hull.vertices.push_back(vertices[i]);
  }
  for (auto& face : faces) {
    std::vector<Index> corners;
    for (Index i : face)
      if (number[static_cast<std::size_t>(i)] >= 0) corners.push_back(number[static_cast<std::size_t>(i)]);
    AMONTONS_REQUIRE(corners.size() >= 3, "convex hull: the body is flat; give it a thickness");
    hull.faces.push_back(std::move(corners));
  }
}

void set_planes(ConvexHull& hull) {
  for (const auto& face : hull.faces) {
    const Vec3& o = at(hull.vertices, face[0]);
    Vec3 area;
    for (std::size_t k = 2; k < face.size(); ++k)
      area += cross(at(hull.vertices, face[k - 1]) - o, at(hull.vertices, face[k]) - o);
    const Vec3 normal = normalised(area);
    double offset = dot(normal, o);
    for (Index i : face) offset = std::max(offset, dot(normal, at(hull.vertices, i)));
    hull.normals.push_back(normal);
    hull.offsets.push_back(offset);
  }
}

void set_neighbours(ConvexHull& hull) {
  hull.neighbours.resize(hull.vertices.size());
  for (const auto& face : hull.faces)
    for (std::size_t k = 0; k < face.size(); ++k)
      hull.neighbours[static_cast<std::size_t>(face[k])].push_back(face[(k + 1) % face.size()]);
  for (auto& list : hull.neighbours) std::sort(list.begin(), list.end());
}

void set_extent(ConvexHull& hull) {
  Vec3 lower = hull.vertices[0], upper = lower;
  for (const Vec3& p : hull.vertices)
    for (int i = 0; i < 3; ++i) {
      lower[i] = std::min(lower[i], p[i]);
      upper[i] = std::max(upper[i], p[i]);
    }
  hull.extent = 0.5 * norm(upper - lower);
}

void check_convex(const ConvexHull& hull, double tolerance) {
  for (std::size_t f = 0; f < hull.faces.size(); ++f)
    for (const Vec3& p : hull.vertices)
      AMONTONS_REQUIRE(dot(hull.normals[f], p) <= hull.offsets[f] + tolerance,
                       "convex hull: the body is not convex at the face with normal (" +
                           std::to_string(hull.normals[f].x) + ", " + std::to_string(hull.normals[f].y) +
                           ", " + std::to_string(hull.normals[f].z) + "); use its convex hull, or split it");
}

}  // namespace

Hull make_hull(std::span<const Vec3> vertices, std::span<const Triangle> triangles) {
  check_input(vertices, triangles);
  AMONTONS_REQUIRE(triangles.size() >= 4,
                   "convex hull: it needs at least four triangles, not " + std::to_string(triangles.size()));
  const std::vector<HalfEdge> edges = sorted_edges(triangles);
  check_closed(edges);

  Vec3 centre;
  for (const HalfEdge& e : edges) centre += at(vertices, e.from);
  centre = centre / static_cast<double>(edges.size());
  double size = 0, volume = 0;
  for (const HalfEdge& e : edges) size = std::max(size, norm(at(vertices, e.from) - centre));
  for (const Triangle& t : triangles)
    volume += dot(at(vertices, t[0]) - centre, area_vector(vertices, t)) / 6;
  AMONTONS_REQUIRE(std::abs(volume) > 1e-9 * size * size * size,
                   "convex hull: the body is flat; give it a thickness");
  AMONTONS_REQUIRE(volume > 0, "convex hull: the triangles face inwards; reverse the order of their corners");

  // Coordinates in single precision, as many files hold, leave flat faces flat to about 1e-7 of their size.
  const double tolerance = 1e-6 * size;
  Index groups = 0;
  const std::vector<Index> group = group_coplanar(vertices, triangles, edges, tolerance, groups);
  auto hull = std::make_shared<ConvexHull>();
  keep_corners(vertices, trace_rims(triangles, edges, group, groups), *hull);
  set_planes(*hull);
  set_neighbours(*hull);
  set_extent(*hull);
  check_convex(*hull, 4 * tolerance);
  return {std::move(hull)};
}

}  // namespace amontons
