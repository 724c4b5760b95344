#include "collision/narrow/epa.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

// The expanding polytope algorithm (van den Bergen, Collision Detection in Interactive 3D Environments,
// section 4.3.8). The origin is inside the difference C of the cores, and the shortest translation out of C
// is that of the overlap. A polytope inside C that contains the origin grows at its face nearest to the
// origin. The plane of this face bounds the depth from below, the plane that supports C along the same normal
// from above. If the two agree the face is on the surface of C, and the foot of the origin on it gives the
// deepest points.
//
// For polyhedra this ends on the surface after finitely many points. Round surfaces are approached by ever
// smaller triangles; the tolerance is relative to the sizes, and separation.cpp refines the result. The
// difficulty is rounding. Triangles become needles without a meaningful normal, and a point may see a face
// only by its last bit. So every face stores the error of its normal. If the result is no longer a polytope
// the search ends with the best bounds so far, which are valid at any time.
namespace amontons::collision {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

struct PolytopeFace {
  int corner[3];  // counter-clockwise seen from outside
  int across[3];  // the face beyond the edge from corner k to corner k + 1
  Vec3 normal;
  double distance;  // of its plane from the origin; infinite for needles, which are never nearest
  double error;     // of the normal by rounding; infinite if there is no normal
  bool removed;
};

// Triangles that form a closed convex polytope, in memory of fixed size. Each stores its three neighbours, so
// that the faces that a new point sees are found by walking from one of them.
struct Polytope {
  // A closed surface of triangles with n corners has 2 n - 4 of them (Euler).
  static constexpr int most_points = 132, most_faces = 2 * most_points;
  DifferencePoint point[most_points];
  PolytopeFace face[most_faces];
  int unused[most_faces];  // faces removed earlier
  // Faces are identified by their places, which do not change while neighbours refer to them.
  int rim[most_faces][2];  // of the hole: a remaining face, and its edge
  int points, faces, free_faces, rim_edges;
  double rounding;  // of the coordinates

  // The tetrahedron of the first four points, with all faces seen from outside; `positive`: the fourth is
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

  // The face whose plane is nearest to the origin, which bounds the depth from below. A plain loop: there are
  // a few dozen faces, and a heap would have to track removed ones.
  int nearest_face() const {
    int best = -1;
    for (int f = 0; f < faces; ++f)
      if (!face[f].removed && (best < 0 || face[f].distance < face[best].distance)) best = f;
    return best;
  }

  // Replaces the faces that p sees, a known one among them, by the cone over their rim, which gives the
  // convex hull of the polytope and p. False: no room is left, or rounding made a rim that is not a simple
  // loop.
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
      // Edge 0 is that of the rim, so that the cone connects to the remaining faces.
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
  // The rounding error of a triangle's normal is that of the coordinates over its height, area / longest. A
  // needle's normal could make it nearest by chance, so its distance is infinite.
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
  // Its place is reused by the next added face; until then its corners and neighbours stay readable.
  void remove(int number) {
    face[number].removed = true;
    unused[free_faces++] = number;
  }
  // Links two consecutive faces of the cone around its apex.
  void join(int before, int after) {
    face[before].across[1] = after;
    face[after].across[2] = before;
  }

  // Whether p is beyond a face's plane by more than rounding. Every point sees needles, so that the next near
  // point removes them.
  bool sees(const Vec3& p, const PolytopeFace& f) const {
    if (f.error == infinity) return true;
    const Vec3 d = p - point[f.corner[0]].w;
    return dot(f.normal, d) > rounding + f.error * norm(d);
  }

  // Crosses an edge of a removed face. Removes the connected faces that p sees beyond it, and lists the rim
  // of the hole in order. Depth first from the edge of entry, which has the number `back` in the face beyond,
  // and around that face in the order of its edges.
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

  // A corner of edge r of the rim: its beginning (end = 0) or end (1), seen from the remaining face.
  int rim_corner(int r, int end) const { return face[rim[r][0]].corner[(rim[r][1] + end) % 3]; }

  // Seen from the remaining faces the rim is traversed backwards: each edge begins where the next one ends.
  // Rounding in sees() can give a rim that touches itself; a cone over it would not be a polytope.
  bool is_rim_a_loop() const {
    if (rim_edges < 3) return false;
    for (int r = 0; r < rim_edges; ++r)
      if (rim_corner(r, 0) != rim_corner((r + 1) % rim_edges, 1)) return false;
    return true;
  }
};

// The cross product with the coordinate axis most perpendicular to e, where it is longest.
Vec3 any_perpendicular(const Vec3& e) {
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(e[i]) < std::abs(e[least])) least = i;
  Vec3 axis;
  axis[least] = 1;
  return normalised(cross(e, axis));
}

// Number of independent points of a simplex: a tetrahedron thinner than the tolerance counts as a triangle,
// and so on down to a point.
int independent_points(const Polytope& hull, int n, double tolerance) {
  const Vec3 o = hull.point[0].w, e = hull.point[1].w - o, f = hull.point[2].w - o, normal = cross(e, f);
  if (n == 4 && std::abs(dot(normal, hull.point[3].w - o)) > tolerance * norm(normal)) return 4;
  if (n >= 3 && !(norm(normal) <= tolerance * std::max(norm(e), norm(f)))) return 3;
  return n >= 2 && !(norm(e) <= tolerance) ? 2 : 1;
}

// Directions out of the span of the first n points, including opposite ones; the rest are zero.
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

// Grows a simplex that contains the origin to a tetrahedron, each time by the extreme point farthest out of
// its span. GJK ends with fewer than four points if the origin is on a corner, edge or face of its simplex.
// Returns the number of points: fewer than four if the whole difference is flat.
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

// The difference is a polygon, a segment or a point, without an inside: both cores are in one plane, or on
// one line. They separate across it, at zero depth. Examples are a segment that cuts a triangle in its own
// plane, and two concentric spheres, whose cores are points.
void part_flat(const Convex& a, const Convex& b, const Polytope& hull, int points, Separation& result) {
  const Vec3 o = hull.point[0].w;
  Vec3 normal{0, 0, 1};
  if (points == 3) normal = normalised(cross(hull.point[1].w - o, hull.point[2].w - o));
  if (points == 2) normal = any_perpendicular(normalised(hull.point[1].w - o));
  result.normal = dot(normal, a.centre - b.centre) < 0 ? -normal : normal;
  result.distance = 0;
  // The nearest of the known points: an origin inside a flat simplex has them all around it.
  result.on_a = result.on_b = {};
  for (int i = 0; i < points; ++i) {
    result.on_a += (1.0 / points) * hull.point[i].a;
    result.on_b += (1.0 / points) * hull.point[i].b;
  }
  result.on_a = result.on_b = 0.5 * (result.on_a + result.on_b);
}

// Several coplanar triangles often form one face of C, and the foot is in only one of them, not always in the
// nearest one found. Finds the foot of the origin on the plane { <normal, w> = depth } in the face of this
// plane that contains it. Its weights applied to the points of a and b behind the corners give the deepest
// points.
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
  // Allowed difference of the bounds of the depth. Flat surfaces are reached exactly, round ones approached:
  // much finer triangles are rounding. Between two smooth bodies sharpen_smooth() refines the result.
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
  // Invariant: the polytope is within C and contains the origin, up to rounding. Every tried direction
  // separates the bodies, and the nearest face bounds the shortest one from below. The last face contains the
  // foot of the origin. If rounding spoiled it, the best direction found still has the right depth.
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
