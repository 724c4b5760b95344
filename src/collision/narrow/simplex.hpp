#pragma once
#include "collision/narrow/convex.hpp"

// Simplices of the difference { a - b } of two cores, the set of all vectors from a point of b to one of a:
// it holds the origin if the cores overlap, and its point nearest to the origin is their distance otherwise.
namespace amontons::collision {

// A point of the difference, and the two points that it comes from.
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

// The subset of a simplex that holds its point nearest to the origin, and the weights of its corners there.
struct Nearest {
  int index[3];
  double weight[3];
  int count = 0;
  Vec3 point;
  double squared = 0;  // distance from the origin
};
Nearest nearest_on_triangle(const Simplex& s, int i, int j, int k);

// Reduces the simplex to what holds its point v nearest to the origin; false if that is the origin itself,
// inside a tetrahedron, which then stays as it is.
bool reduce(Simplex& s, Vec3& v);

}  // namespace amontons::collision
