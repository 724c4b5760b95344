#pragma once
#include <algorithm>
#include <array>
#include <initializer_list>

#include "collision/narrow/convex.hpp"

namespace amontons::collision {

// Corners (count) of the polygon that stands for a round cap: twelve leave out 1 - cos(15 degrees), 3 % of
// the radius, at the middle of a side. The polygon has (cos, sin) of the corners on the unit circle.
constexpr int cap_corners = 12;
using CapPolygon = std::array<std::array<double, 2>, cap_corners>;
const CapPolygon& cap_polygon();

// The feature of a body (radius included) that supports it along a unit direction. It is a face whose normal
// is close to the direction, an edge that is nearly perpendicular to it, or the extreme point.
struct Feature {
  static constexpr int capacity = 64;  // faces with more corners are reduced
  int count = 0;                       // 1: a point, 2: an edge, 3 and more: a flat face
  Vec3 normal;                         // of a face, unit, outwards
  Vec3 points[capacity];               // faces: counter-clockwise seen from outside

  // Sets the corners; the normal of a face is set separately.
  void set(std::initializer_list<Vec3> corners) {
    count = static_cast<int>(corners.size());
    std::copy(corners.begin(), corners.end(), points);
  }
};
// `through` (a point on the body's surface, or null): among several faces one that contains this point is
// chosen, so that the deepest contact point is never lost. `phase`: the direction of the first corner of a
// round cap (null: fixed in the body).
void supporting_feature(const Convex& body, const Vec3& direction, const Vec3* through, const Vec3* phase,
                        Feature& feature);

}  // namespace amontons::collision
