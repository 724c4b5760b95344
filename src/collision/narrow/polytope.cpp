#include "collision/narrow/polytope.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons::collision {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

// The normal of a triangle with coordinates good to `rounding` is good to rounding over its height, which is
// area / longest. A needle's normal would make it look nearest by chance, so it keeps an infinite distance.
int Polytope::add_face(int i, int j, int k) {
  const int number = free_faces > 0 ? unused[--free_faces] : faces++;
  const Vec3 ab = point[j].w - point[i].w, ac = point[k].w - point[i].w, bc = ac - ab, n = cross(ab, ac);
  const double area = norm_squared(n);
  const double longest = std::max({norm_squared(ab), norm_squared(ac), norm_squared(bc)});
  PolytopeFace& f = face[number];
  f = {{i, j, k}, {-1, -1, -1}, {}, infinity, infinity, false};
  if (area <= 1e-28 * longest * longest) return number;
  f.normal = n / std::sqrt(area);
  f.error = rounding * std::sqrt(longest / area);
  if (f.error < 1e-8) f.distance = dot(f.normal, point[i].w);
  return number;
}

// Whether p lies beyond a face's plane by more than rounding; needles are seen from everywhere, so that the
// next point that comes near them takes them away.
bool Polytope::sees(const Vec3& p, const PolytopeFace& f) const {
  if (f.error == infinity) return true;
  const Vec3 d = p - point[f.corner[0]].w;
  return dot(f.normal, d) > rounding + f.error * norm(d);
}

// Removes the connected faces that p sees, and lists the rim of the hole in order: depth first from the edge
// it came by, which visits the neighbours of every face in the order of its edges.
void Polytope::remove_seen(int number, int edge, const Vec3& p) {
  PolytopeFace& f = face[number];
  if (f.removed) return;
  if (!sees(p, f)) {
    rim[rim_edges][0] = number;
    rim[rim_edges++][1] = edge;
    return;
  }
  f.removed = true;
  unused[free_faces++] = number;
  for (int k = 1; k < 3; ++k) remove_beyond(number, (edge + k) % 3, p);
}

// Goes on across an edge of a removed face, with the number that the edge has in the face beyond.
void Polytope::remove_beyond(int number, int edge, const Vec3& p) {
  const int next = face[number].across[edge];
  int back = 0;
  while (face[next].across[back] != number) ++back;
  remove_seen(next, back, p);
}

// A corner of edge r of the rim: its beginning (end = 0) or end (1), seen from the face that stays.
int Polytope::rim_corner(int r, int end) const { return face[rim[r][0]].corner[(rim[r][1] + end) % 3]; }

// Seen from the faces that stay the rim runs backwards: each edge begins where the next one ends. Rounding in
// sees() can leave a rim that touches itself, over which a cone would be no polytope.
bool Polytope::is_rim_a_loop() const {
  if (rim_edges < 3) return false;
  for (int r = 0; r < rim_edges; ++r)
    if (rim_corner(r, 0) != rim_corner((r + 1) % rim_edges, 1)) return false;
  return true;
}

bool Polytope::expand(int seed, const DifferencePoint& p) {
  if (points == most_points) return false;
  rim_edges = 0;
  face[seed].removed = true;
  unused[free_faces++] = seed;
  for (int k = 0; k < 3; ++k) remove_beyond(seed, k, p.w);
  if (!is_rim_a_loop()) return false;
  point[points++] = p;
  int first = -1, last = -1;
  for (int r = 0; r < rim_edges; ++r) {
    if (free_faces == 0 && faces == most_faces) return false;
    const int number = add_face(rim_corner(r, 1), rim_corner(r, 0), points - 1);
    face[number].across[0] = rim[r][0];
    face[rim[r][0]].across[rim[r][1]] = number;
    // The faces of the cone follow each other round the apex: edge 2 leads back, edge 1 on.
    if (last >= 0) {
      face[number].across[2] = last;
      face[last].across[1] = number;
    } else {
      first = number;
    }
    last = number;
  }
  face[first].across[2] = last;
  face[last].across[1] = first;
  return true;
}

void Polytope::start(bool positive) {
  points = 4;
  faces = free_faces = 0;
  const int j = positive ? 1 : 2, k = positive ? 2 : 1;
  add_face(0, j, k);
  add_face(0, k, 3);
  add_face(k, j, 3);
  add_face(j, 0, 3);
  constexpr int across[4][3] = {{3, 2, 1}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}};
  for (int f = 0; f < 4; ++f)
    for (int e = 0; e < 3; ++e) face[f].across[e] = across[f][e];
}

int Polytope::nearest_face() const {
  int best = -1;
  for (int f = 0; f < faces; ++f)
    if (!face[f].removed && (best < 0 || face[f].distance < face[best].distance)) best = f;
  return best;
}

}  // namespace amontons::collision
