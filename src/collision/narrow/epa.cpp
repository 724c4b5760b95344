#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/narrow/gjk.hpp"

// The expanding polytope algorithm (van den Bergen, Collision Detection in Interactive 3D Environments,
// section 4.3.8): a polytope inside the difference of the cores grows at its face nearest to the origin until
// that face lies on the difference's surface.
namespace amontons::collision {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct PolytopeFace {
  int corner[3];  // counter-clockwise seen from outside
  int across[3];  // the face beyond the edge from corner k to corner k + 1
  Vec3 normal;
  double distance;  // of its plane from the origin; infinite for needles, which are never the nearest
  double error;     // of the normal by rounding, infinite where there is none
  bool removed;
};

struct Polytope {
  static constexpr int most_points = 132, most_faces = 2 * most_points;
  DifferencePoint point[most_points];
  PolytopeFace face[most_faces];
  int unused[most_faces];  // faces removed earlier
  int rim[most_faces][2];  // of the hole: a face that stays, and its edge
  int points, faces, free_faces, rim_edges;
  double rounding;  // of the coordinates

  int add_face(int i, int j, int k);
  bool sees(const Vec3& p, const PolytopeFace& f) const;
  void remove_seen(int f, int edge, const Vec3& p);
  bool expand(int seed, const DifferencePoint& p);
  void start(bool positive);
  int nearest_face() const;
};

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

bool Polytope::sees(const Vec3& p, const PolytopeFace& f) const {
  if (f.error == infinity) return true;
  const Vec3 d = p - point[f.corner[0]].w;
  return dot(f.normal, d) > rounding + f.error * norm(d);
}

// Removes the connected faces that p sees, and lists the rim of the hole in order.
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
  for (int k = 1; k < 3; ++k) {
    const int side = (edge + k) % 3, next = f.across[side];
    int back = 0;
    while (face[next].across[back] != number) ++back;
    remove_seen(next, back, p);
  }
}

// Replaces the faces that p sees, a known one among them, by the cone over their rim. False: no room left, or
// rounding made a rim that is no simple loop.
bool Polytope::expand(int seed, const DifferencePoint& p) {
  if (points == most_points) return false;
  rim_edges = 0;
  face[seed].removed = true;
  unused[free_faces++] = seed;
  for (int k = 0; k < 3; ++k) {
    const int next = face[seed].across[k];
    int back = 0;
    while (face[next].across[back] != seed) ++back;
    remove_seen(next, back, p.w);
  }
  if (rim_edges < 3) return false;
  const auto corner = [&](int r, int end) { return face[rim[r][0]].corner[(rim[r][1] + end) % 3]; };
  for (int r = 0; r < rim_edges; ++r)
    if (corner(r, 0) != corner((r + 1) % rim_edges, 1)) return false;
  point[points++] = p;
  int first = -1, last = -1;
  for (int r = 0; r < rim_edges; ++r) {
    if (free_faces == 0 && faces == most_faces) return false;
    const int number = add_face(corner(r, 1), corner(r, 0), points - 1);
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

// The tetrahedron of the first four points; `positive`: the fourth lies behind the first three.
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

Vec3 any_perpendicular(const Vec3& e) {
  const Vec3 a{std::abs(e.x), std::abs(e.y), std::abs(e.z)};
  const Vec3 least = a.x <= a.y && a.x <= a.z ? Vec3{1, 0, 0} : a.y <= a.z ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
  return normalised(cross(e, least));
}

bool is_round(const Convex& body) {
  return body.kind == Convex::Kind::cylinder || body.kind == Convex::Kind::ellipsoid;
}

// Grows a simplex that holds the origin to a tetrahedron by extreme points. Returns how many points it got:
// fewer than four when the whole difference is flat.
int grow_to_tetrahedron(const Convex& a, const Convex& b, const Simplex& s, double tolerance,
                        Polytope& hull) {
  for (int i = 0; i < s.count; ++i) hull.point[i] = s.point[i];
  int n = s.count;
  if (n == 4) {
    const Vec3 o = hull.point[0].w;
    const Vec3 e = hull.point[1].w - o, f = hull.point[2].w - o, g = hull.point[3].w - o;
    if (std::abs(dot(cross(e, f), g)) > tolerance * norm(cross(e, f))) return 4;
    n = 3;
  }
  if (n == 3) {
    const Vec3 e = hull.point[1].w - hull.point[0].w, f = hull.point[2].w - hull.point[0].w;
    if (norm(cross(e, f)) <= tolerance * std::max(norm(e), norm(f))) n = 2;
  }
  if (n == 2 && norm(hull.point[1].w - hull.point[0].w) <= tolerance) n = 1;
  while (n < 4) {
    const Vec3 o = hull.point[0].w;
    Vec3 directions[6];
    int tries = 0;
    if (n == 1) {
      for (int i = 0; i < 3; ++i) {
        Vec3 d;
        d[i] = 1;
        directions[tries++] = d;
        directions[tries++] = -d;
      }
    } else if (n == 2) {
      const Vec3 e = normalised(hull.point[1].w - o), u = any_perpendicular(e), v = cross(e, u);
      for (const Vec3& d : {u, v, -u, -v}) directions[tries++] = d;
    } else {
      const Vec3 normal = normalised(cross(hull.point[1].w - o, hull.point[2].w - o));
      directions[tries++] = normal;
      directions[tries++] = -normal;
    }
    double farthest = tolerance;
    for (int t = 0; t < tries; ++t) {
      const DifferencePoint p = difference_support(a, b, directions[t]);
      const double distance = dot(directions[t], p.w - o);
      if (distance > farthest) farthest = distance, hull.point[n] = p;
    }
    if (farthest == tolerance) return n;
    ++n;
  }
  return 4;
}

// Both cores lie in one plane, or on one line: they part across it, at no depth.
void part_flat(const Convex& a, const Convex& b, const Polytope& hull, int points, Separation& result) {
  const Vec3 o = hull.point[0].w;
  Vec3 normal{0, 0, 1};
  if (points == 3) normal = normalised(cross(hull.point[1].w - o, hull.point[2].w - o));
  if (points == 2) normal = any_perpendicular(normalised(hull.point[1].w - o));
  result.normal = dot(normal, a.centre - b.centre) < 0 ? -normal : normal;
  result.distance = 0;
  // The nearest of the points at hand: an origin inside a flat simplex has them all around it.
  result.on_a = result.on_b = {};
  for (int i = 0; i < points; ++i) {
    result.on_a += (1.0 / points) * hull.point[i].a;
    result.on_b += (1.0 / points) * hull.point[i].b;
  }
  const Vec3 middle = 0.5 * (result.on_a + result.on_b);
  result.on_a = result.on_b = middle;
}

// The foot of the origin on the plane { <normal, w> = depth }, in the one of the faces in this plane that
// holds it.
void set_foot(const Polytope& hull, const Vec3& normal, double depth, double tolerance, Separation& result) {
  double nearest = infinity;
  for (int number = 0; number < hull.faces; ++number) {
    const PolytopeFace& f = hull.face[number];
    if (f.removed) continue;
    Simplex face;
    face.count = 3;
    bool in_plane = true;
    for (int k = 0; k < 3; ++k) {
      face.point[k] = hull.point[f.corner[k]];
      const double height = dot(normal, face.point[k].w);
      in_plane = in_plane && height >= depth - tolerance;
      face.point[k].w -= height * normal;
    }
    if (!in_plane) continue;
    const Nearest foot = nearest_on_triangle(face, 0, 1, 2);
    if (!(foot.squared < nearest)) continue;
    nearest = foot.squared;
    result.on_a = result.on_b = {};
    for (int k = 0; k < foot.count; ++k) {
      result.on_a += foot.weight[k] * face.point[foot.index[k]].a;
      result.on_b += foot.weight[k] * face.point[foot.index[k]].b;
    }
  }
}

}  // namespace

void penetration(const Convex& a, const Convex& b, const Simplex& simplex, Separation& result) {
  thread_local Polytope hull;
  const PairScale scale = pair_scale(a, b);
  const double rounding = 1e-14 * scale.reach;
  // Flat surfaces are met, round ones approached: triangles much finer than this are rounding. Between two
  // smooth bodies sharpen() does the rest.
  const bool smooth = a.kind == Convex::Kind::ellipsoid && b.kind == Convex::Kind::ellipsoid;
  const double converged = (smooth                       ? 1e-5
                            : is_round(a) || is_round(b) ? 1e-8
                                                         : 1e-10) *
                               scale.size +
                           rounding;

  const int points = grow_to_tetrahedron(a, b, simplex, 100 * rounding, hull);
  if (points < 4) return part_flat(a, b, hull, points, result);
  const Vec3 o = hull.point[0].w;
  hull.rounding = rounding;
  hull.start(dot(cross(hull.point[1].w - o, hull.point[2].w - o), hull.point[3].w - o) < 0);
  // Every direction tried is a way out, and the nearest face bounds the shortest one from below. The last
  // face holds the foot of the origin; should rounding have spoilt it, the best direction met has at least
  // the depth right.
  double least = infinity;
  for (;;) {
    const int nearest = hull.nearest_face();
    const double bound = hull.face[nearest].distance;
    const Vec3 direction = hull.face[nearest].normal;
    const DifferencePoint p = difference_support(a, b, direction);
    const double depth = dot(direction, p.w);
    if (depth < least) {
      least = depth;
      result.normal = -direction;
      result.distance = -depth;
      result.on_a = p.a, result.on_b = p.b;
    }
    if (depth - bound <= converged) {
      result.normal = -direction;
      result.distance = -depth;
      return set_foot(hull, direction, bound, 4 * converged, result);
    }
    if (least - bound <= converged || !hull.expand(nearest, p))
      return set_foot(hull, -result.normal, least, 1e-6 * scale.size + 4 * (least - bound), result);
  }
}

}  // namespace amontons::collision
