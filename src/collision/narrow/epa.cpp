#include "collision/narrow/epa.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

// The expanding polytope algorithm (van den Bergen, Collision Detection in Interactive 3D Environments,
// section 4.3.8). The origin lies inside the difference C of the cores, and the shortest way out of C is
// that of the overlap. A polytope inside C that holds the origin grows at its face nearest to the
// origin: the plane of this face bounds the depth from below, the plane that supports C along the same
// normal from above. Where the two agree the face lies on the surface of C, and the origin's foot on it
// gives the deepest points.
//
// For polyhedra this ends on the surface after finitely many points. Round surfaces are approached by ever
// smaller triangles; the tolerance is relative to the sizes, and separation.cpp sharpens what is left. What
// is hard is rounding: triangles become needles whose normals mean nothing, and a point may see a face by its
// last bit only. So every face knows the error of its normal, and a result that is no polytope any more ends
// the search with the best bounds met so far, which are valid at any time.
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

// Triangles that close to a convex polytope in memory of fixed size. Each knows its three neighbours, so that
// the faces that a new point sees are found by walking from one of them.
struct Polytope {
  // A closed surface of triangles with n corners has 2 n - 4 of them (Euler).
  static constexpr int most_points = 132, most_faces = 2 * most_points;
  DifferencePoint point[most_points];
  PolytopeFace face[most_faces];
  int unused[most_faces];  // faces removed earlier
  // Faces are named by their places, which do not move while neighbours refer to them.
  int rim[most_faces][2];  // of the hole: a face that stays, and its edge
  int points, faces, free_faces, rim_edges;
  double rounding;  // of the coordinates

  // The tetrahedron of the first four points, with all faces seen from outside; `positive`: the fourth lies
  // behind the first three.
  void start(bool positive) {
    points = 4;
    faces = free_faces = 0;
    const int j = positive ? 1 : 2, k = positive ? 2 : 1;
    add_face(0, j, k);
    add_face(0, k, 3);
    add_face(k, j, 3);
    add_face(j, 0, 3);
    constexpr int across[4][3] = {{3, 2, 1}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}};
    for (int f = 0; f < 4; ++f) std::copy_n(across[f], 3, face[f].across);
  }

  // The one whose plane is nearest to the origin, and so bounds the depth from below. A plain loop: there are
  // a few dozen faces, and a heap would have to follow those that are removed.
  int nearest_face() const {
    int best = -1;
    for (int f = 0; f < faces; ++f)
      if (!face[f].removed && (best < 0 || face[f].distance < face[best].distance)) best = f;
    return best;
  }

  // Replaces the faces that p sees, a known one among them, by the cone over their rim: what is then the
  // convex hull of the polytope and p. False: no room left, or rounding made a rim that is no simple loop.
  bool expand(int seed, const DifferencePoint& p) {
    if (points == most_points) return false;
    rim_edges = 0;
    remove(seed);
    for (int k = 0; k < 3; ++k) remove_beyond(seed, k, p.w);
    if (!is_rim_a_loop()) return false;
    point[points++] = p;
    int first = -1, last = -1;
    for (int r = 0; r < rim_edges; ++r) {
      if (free_faces == 0 && faces == most_faces) return false;
      const int number = add_face(rim_corner(r, 1), rim_corner(r, 0), points - 1);
      face[number].across[0] = rim[r][0];
      face[rim[r][0]].across[rim[r][1]] = number;
      // Edge 0 is that of the rim, so that the cone closes with the faces that stay.
      // The faces of the cone follow each other round the apex: edge 2 leads back, edge 1 on.
      if (r == 0)
        first = number;
      else
        join(last, number);
      last = number;
    }
    join(last, first);
    return true;
  }

 private:
  // The normal of a triangle with coordinates good to `rounding` is good to rounding over its height, which
  // is area / longest. A needle's normal would make it look nearest by chance, so it keeps an infinite
  // distance.
  int add_face(int i, int j, int k) {
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
  // Its place is given to the next face that is added; until then its corners and neighbours stay readable.
  void remove(int number) {
    face[number].removed = true;
    unused[free_faces++] = number;
  }
  // Two faces of the cone, one after the other around its apex.
  void join(int before, int after) {
    face[before].across[1] = after;
    face[after].across[2] = before;
  }

  // Whether p lies beyond a face's plane by more than rounding; needles are seen from everywhere, so that the
  // next point that comes near them takes them away.
  bool sees(const Vec3& p, const PolytopeFace& f) const {
    if (f.error == infinity) return true;
    const Vec3 d = p - point[f.corner[0]].w;
    return dot(f.normal, d) > rounding + f.error * norm(d);
  }

  // Goes across an edge of a removed face. Removes the connected faces that p sees beyond it, and lists the
  // rim of the hole in order: depth first from the edge it came by, which has the number `back` in the face
  // beyond, and on round that face in the order of its edges.
  void remove_beyond(int number, int edge, const Vec3& p) {
    const int next = face[number].across[edge];
    if (face[next].removed) return;
    int back = 0;
    while (face[next].across[back] != number) ++back;
    if (!sees(p, face[next])) {
      rim[rim_edges][0] = next;
      rim[rim_edges++][1] = back;
      return;
    }
    remove(next);
    for (int k = 1; k < 3; ++k) remove_beyond(next, (back + k) % 3, p);
  }

  // A corner of edge r of the rim: its beginning (end = 0) or end (1), seen from the face that stays.
  int rim_corner(int r, int end) const { return face[rim[r][0]].corner[(rim[r][1] + end) % 3]; }

  // Seen from the faces that stay the rim runs backwards: each edge begins where the next one ends. Rounding
  // in sees() can leave a rim that touches itself, over which a cone would be no polytope.
  bool is_rim_a_loop() const {
    if (rim_edges < 3) return false;
    for (int r = 0; r < rim_edges; ++r)
      if (rim_corner(r, 0) != rim_corner((r + 1) % rim_edges, 1)) return false;
    return true;
  }
};

// Across the coordinate axis that e is most perpendicular to, where the product is longest.
Vec3 any_perpendicular(const Vec3& e) {
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(e[i]) < std::abs(e[least])) least = i;
  Vec3 axis;
  axis[least] = 1;
  return normalised(cross(e, axis));
}

// How many points of a simplex span something: a tetrahedron that is thinner than the tolerance counts as a
// triangle, and so on down to a point.
int independent_points(const Polytope& hull, int n, double tolerance) {
  const Vec3 o = hull.point[0].w, e = hull.point[1].w - o, f = hull.point[2].w - o, normal = cross(e, f);
  if (n == 4 && std::abs(dot(normal, hull.point[3].w - o)) > tolerance * norm(normal)) return 4;
  if (n >= 3 && !(norm(normal) <= tolerance * std::max(norm(e), norm(f)))) return 3;
  return n >= 2 && !(norm(e) <= tolerance) ? 2 : 1;
}

// Directions out of the span of the first n points, opposite ones among them; zero behind the last one.
std::array<Vec3, 6> directions_out_of(const Polytope& hull, int n) {
  const Vec3 o = hull.point[0].w, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  if (n == 1) return {x, -x, y, -y, z, -z};
  if (n == 3) {
    const Vec3 normal = normalised(cross(hull.point[1].w - o, hull.point[2].w - o));
    return {normal, -normal};
  }
  const Vec3 e = normalised(hull.point[1].w - o), u = any_perpendicular(e), v = cross(e, u);
  return {u, v, -u, -v};
}

// Grows a simplex that holds the origin to a tetrahedron by extreme points: the farthest out of its span each
// time. GJK ends with fewer than four where the origin lies on a corner, an edge or a face of its simplex.
// Returns how many points it got: fewer than four when the whole difference is flat.
int grow_to_tetrahedron(const Convex& a, const Convex& b, const Simplex& s, double tolerance,
                        Polytope& hull) {
  for (int i = 0; i < s.count; ++i) hull.point[i] = s.point[i];
  int n = independent_points(hull, s.count, tolerance);
  for (; n < 4; ++n) {
    double farthest = tolerance;
    for (const Vec3& d : directions_out_of(hull, n)) {
      if (d == Vec3{}) break;
      const DifferencePoint p = difference_support(a, b, d);
      const double distance = dot(d, p.w - hull.point[0].w);
      if (distance > farthest) {
        farthest = distance;
        hull.point[n] = p;
      }
    }
    if (farthest == tolerance) break;
  }
  return n;
}

// The difference is a polygon, a segment or a point, without an inside. Both cores lie in one plane, or on
// one line: they part across it, at no depth. Here belong a segment that cuts a triangle in its own plane,
// and two spheres on one centre, whose cores are points.
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
  result.on_a = result.on_b = 0.5 * (result.on_a + result.on_b);
}

// Several coplanar triangles often make up one face of C, and the foot lies in one of them only, not always
// in the one that was found nearest. The foot of the origin on the plane { <normal, w> = depth }, in the one
// of the faces in this plane that holds it: with its weights the points of a and b that the corners come from
// give the deepest points.
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
  thread_local Polytope hull;  // some 30 kB: too large to be cleared on the stack for every pair
  const PairScale scale = pair_scale(a, b);
  const double rounding = 1e-14 * scale.reach;
  // How far the bounds of the depth may be apart. Flat surfaces are met, round ones approached: triangles
  // much finer than this are rounding. Between two smooth bodies sharpen_smooth() does the rest.
  using Kind = Convex::Kind;
  const auto any = [&](Kind kind) { return a.kind == kind || b.kind == kind; };
  const bool both_smooth = a.kind == Kind::ellipsoid && b.kind == Kind::ellipsoid;
  const double relative = both_smooth ? 1e-5 : any(Kind::cylinder) || any(Kind::ellipsoid) ? 1e-8 : 1e-10;
  const double converged = relative * scale.size + rounding;

  // A tetrahedron with the origin inside or on it is the first polytope.
  const int points = grow_to_tetrahedron(a, b, simplex, 100 * rounding, hull);
  if (points < 4) return part_flat(a, b, hull, points, result);
  const Vec3 o = hull.point[0].w;
  hull.rounding = rounding;
  hull.start(dot(cross(hull.point[1].w - o, hull.point[2].w - o), hull.point[3].w - o) < 0);
  // Invariant: the polytope lies within C and holds the origin, up to rounding.
  // Every direction tried is a way out, and the nearest face bounds the shortest one from below. The
  // last face holds the foot of the origin; should rounding have spoilt it, the best direction met has
  // at least the depth right.
  double least = infinity;
  for (;;) {
    const int nearest = hull.nearest_face();
    const double bound = hull.face[nearest].distance;
    const Vec3 direction = hull.face[nearest].normal;
    const DifferencePoint p = difference_support(a, b, direction);
    const double depth = dot(direction, p.w);
    if (depth < least) {
      least = depth;
      result = {true, -depth, -direction, p.a, p.b};
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
