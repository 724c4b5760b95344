#pragma once
#include "collision/narrow/convex.hpp"

namespace amontons::collision {

// A point of the difference of two cores, { a - b }, and the two points that it comes from.
struct DifferencePoint {
  Vec3 w, a, b;
};
struct Simplex {
  DifferencePoint point[4];
  double weight[4];
  int count = 0;
};

inline DifferencePoint difference_support(const Convex& a, const Convex& b, const Vec3& direction) {
  const Vec3 p = support(a, direction), q = support(b, -direction);
  return {p - q, p, q};
}

// The subset of a simplex that holds its point nearest to the origin.
struct Nearest {
  int index[3];
  double weight[3];
  int count = 0;
  Vec3 point;
  double squared = 0;
};
Nearest nearest_on_triangle(const Simplex& s, int i, int j, int k);

// How the sizes of two bodies enter tolerances: `size` is the smaller body's, `reach` bounds the coordinates
// and with them rounding.
struct PairScale {
  double size, reach;
};
PairScale pair_scale(const Convex& a, const Convex& b);

// The shortest way to part two cores that overlap or touch, by the expanding polytope algorithm. The simplex
// is the one in which GJK found the origin; the radii are not in `result` yet.
void penetration(const Convex& a, const Convex& b, const Simplex& simplex, Separation& result);

// Sharpens the normal of bodies with round surfaces; radii are in `s`.
void sharpen(const Convex& a, const Convex& b, Separation& s);

}  // namespace amontons::collision
