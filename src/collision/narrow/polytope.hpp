#pragma once
#include "collision/narrow/simplex.hpp"

// The growing polytope of the expanding polytope algorithm (see epa.cpp).
namespace amontons::collision {

struct PolytopeFace {
  int corner[3];  // counter-clockwise seen from outside
  int across[3];  // the face beyond the edge from corner k to corner k + 1
  Vec3 normal;
  double distance;  // of its plane from the origin; infinite for needles, which are never the nearest
  double error;     // of the normal by rounding, infinite where there is none
  bool removed;
};

// Triangles that close to a convex polytope in memory of fixed size. Each knows its three neighbours, so that
// the faces that a new point sees are found by walking from one of them.
struct Polytope {
  static constexpr int most_points = 132, most_faces = 2 * most_points;
  DifferencePoint point[most_points];
  PolytopeFace face[most_faces];
  int unused[most_faces];  // faces removed earlier
  int rim[most_faces][2];  // of the hole: a face that stays, and its edge
  int points, faces, free_faces, rim_edges;
  double rounding;  // of the coordinates

  // The tetrahedron of the first four points; `positive`: the fourth lies behind the first three.
  void start(bool positive);
  int nearest_face() const;
  // Replaces the faces that p sees, a known one among them, by the cone over their rim. False: no room left,
  // or rounding made a rim that is no simple loop.
  bool expand(int seed, const DifferencePoint& p);

 private:
  int add_face(int i, int j, int k);
  bool sees(const Vec3& p, const PolytopeFace& f) const;
  void remove_seen(int f, int edge, const Vec3& p);
  void remove_beyond(int f, int edge, const Vec3& p);
  bool is_rim_a_loop() const;
  int rim_corner(int r, int end) const;
};

}  // namespace amontons::collision
