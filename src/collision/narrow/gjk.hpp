#pragma once
#include "collision/narrow/convex.hpp"

// The distance of two convex bodies is that of the origin from the difference { a - b } of their cores. This
// Minkowski difference is the set of all vectors from a point of b to one of a. If the cores overlap it
// contains the origin; otherwise its point nearest to the origin is their distance. The difference is convex,
// and its support function follows from those of a and b. The algorithms use nothing else: GJK here, from
// outside, and EPA (epa.hpp), from inside.
namespace amontons::collision {

// A point of the difference, and its two points on a and b.
struct DifferencePoint {
  Vec3 w, a, b;
};
// Up to four such points. The weights, nonnegative with the sum 1, give the point of the simplex nearest to
// the origin; the same weights on a and b give the nearest points of the two cores.
struct Simplex {
  DifferencePoint point[4];
  double weight[4];
  int count = 0;
};

// The point of the difference that is extreme along a direction: extreme for a along it, for b against it.
inline DifferencePoint difference_support(const Convex& a, const Convex& b, const Vec3& direction) {
  const Vec3 p = support(a, direction), q = support(b, -direction);
  return {p - q, p, q};
}

// The subset of a simplex that spans its point nearest to the origin, and the weights of its corners there.
struct Nearest {
  int index[3];
  double weight[3];
  int count = 0;
  Vec3 point;
  double squared = 0;  // distance from the origin
};
Nearest nearest_on_triangle(const Simplex& s, int i, int j, int k);

enum class Cores : unsigned char { beyond_limit, apart, overlap };

// The distance of two cores. `apart`: `result` has the distance, the normal and the nearest points of the
// cores. `overlap`, including touching: `simplex` contains the origin, up to rounding.
Cores distance_of_cores(const Convex& a, const Convex& b, double limit, Simplex& simplex, Separation& result);

}  // namespace amontons::collision
