#pragma once
#include <cmath>
#include <cstdint>

#include "amontons/base/math.hpp"

// A triangle of a static surface with its neighbourhood, and what its edges are.
namespace amontons::collision {

// Dihedral angle (rad) below which two triangles are one flat face. It is more than the scatter of
// single-precision corners of fine meshes, and less than what matters: a body of length l sinks in by at most
// l / 40000. The same angle is the tolerance of directions in general.
constexpr double flat_angle = 1e-4;

// Seen from outside: at a convex edge the surface bends away, at a concave one towards the viewer; at a
// border it ends.
enum class EdgeKind : unsigned char { flat, convex, concave, border };

// Edge k goes from corner k to corner k + 1.
struct Facet {
  Vec3 corner[3];
  Vec3 normal;
  EdgeKind edge[3];
  Vec3 opposite[3];        // the far corner of the triangle across edge k, unless it is a border
  std::int64_t vertex[3];  // identifiers of the corners
};

// The unit normal, in the plane of the facet, of edge k, inwards.
inline Vec3 inward_of(const Facet& facet, int k) {
  return normalised(cross(facet.normal, facet.corner[(k + 1) % 3] - facet.corner[k]));
}

// The kind of an edge from a to b of a triangle with unit normal n, whose neighbour has the normal m and a
// third corner c. It is convex if c is below the triangle's plane. The height of c over its distance from the
// edge is the sine of the dihedral angle.
inline EdgeKind edge_kind(const Vec3& a, const Vec3& b, const Vec3& n, const Vec3& m, const Vec3& c) {
  const Vec3 across = cross(n, b - a), to = c - a;
  const Vec3 along = normalised(b - a);
  const double height = dot(n, to), distance = norm(to - dot(to, along) * along);
  // The sine is small at an angle of pi as well, where the neighbour is folded back. It lies onto the
  // triangle's back, which makes a sharp convex edge, or onto its front, which leaves no outside.
  if (dot(n, m) < 0 && std::abs(height) <= flat_angle * distance)
    return dot(across, to) > 0 ? EdgeKind::convex : EdgeKind::flat;
  if (std::abs(height) <= flat_angle * distance) return EdgeKind::flat;
  return height < 0 ? EdgeKind::convex : EdgeKind::concave;
}

// A point of a triangle, and the corners that span it, as bits: one bit for a corner, two for an edge, three
// for a point inside the face.
struct TrianglePoint {
  Vec3 at;
  unsigned feature;
};

// The point of a triangle that is closest to p, by the Voronoi regions of its corners and edges: C. Ericson,
// "Real-Time Collision Detection", section 5.1.5. With a + v ab + w ac in barycentric coordinates, va, vb, vc
// are the signed areas of p's projection with the edges opposite to a, b and c.
inline TrianglePoint closest_point(const Vec3* corner, const Vec3& p) {
  const Vec3 ab = corner[1] - corner[0], ac = corner[2] - corner[0], ap = p - corner[0];
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return {corner[0], 1};
  const Vec3 bp = p - corner[1];
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return {corner[1], 2};
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {corner[0] + (d1 / (d1 - d3)) * ab, 3};
  const Vec3 cp = p - corner[2];
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return {corner[2], 4};
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {corner[0] + (d2 / (d2 - d6)) * ac, 5};
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return {corner[1] + ((d4 - d3) / (d4 - d3 + d5 - d6)) * (corner[2] - corner[1]), 6};
  const double s = 1 / (va + vb + vc);
  return {corner[0] + (vb * s) * ab + (vc * s) * ac, 7};
}

}  // namespace amontons::collision
