#pragma once
#include <algorithm>
#include <initializer_list>

#include "collision/narrow/convex.hpp"

namespace amontons::collision {

// The feature of a body (radius included) that supports it along a unit direction: a face whose normal is
// close to the direction, an edge that is nearly perpendicular to it, or the extreme point.
struct Feature {
  static constexpr int capacity = 64;  // faces with more corners are thinned out
  int count = 0;                       // 1: a point, 2: an edge, 3 and more: a flat face
  Vec3 normal;                         // of a face, unit, outwards
  Vec3 points[capacity];               // faces: counter-clockwise seen from outside

  // The normal of a face is set apart.
  void set(std::initializer_list<Vec3> corners) {
    count = static_cast<int>(corners.size());
    std::copy(corners.begin(), corners.end(), points);
  }
};
// `through` (a point on the body's surface, or null): of several faces choose one that holds this point, so
// that the contact's deepest point is never missed. `phase`: the direction of the first corner of a round cap
// (null: fixed in the body).
void supporting_feature(const Convex& body, const Vec3& direction, const Vec3* through, const Vec3* phase,
                        Feature& feature);

}  // namespace amontons::collision
