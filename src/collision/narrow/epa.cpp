#include "collision/narrow/epa.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/narrow/polytope.hpp"

// The expanding polytope algorithm (van den Bergen, Collision Detection in Interactive 3D Environments,
// section 4.3.8). The origin lies inside the difference C of the cores, and the shortest way out of C is
// that of the overlap. A polytope inside C that holds the origin grows at its face nearest to the
// origin: the plane of this face bounds the depth from below, the plane that supports C along the same
// normal from above. Where the two agree the face lies on the surface of C, and the origin's foot on it
// gives the deepest points.
namespace amontons::collision {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

// Across the coordinate axis that e is most perpendicular to, where the product is longest.
Vec3 any_perpendicular(const Vec3& e) {
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(e[i]) < std::abs(e[least])) least = i;
  Vec3 axis;
  axis[least] = 1;
  return normalised(cross(e, axis));
}

bool is_round(const Convex& body) {
  return body.kind == Convex::Kind::cylinder || body.kind == Convex::Kind::ellipsoid;
}

// How many points of a simplex span something: a tetrahedron that is thinner than the tolerance counts as a
// triangle, and so on down to a point.
int independent_points(const Polytope& hull, int n, double tolerance) {
  const Vec3 o = hull.point[0].w;
  if (n == 4) {
    const Vec3 e = hull.point[1].w - o, f = hull.point[2].w - o, g = hull.point[3].w - o;
    if (std::abs(dot(cross(e, f), g)) > tolerance * norm(cross(e, f))) return 4;
    n = 3;
  }
  if (n == 3) {
    const Vec3 e = hull.point[1].w - o, f = hull.point[2].w - o;
    if (!(norm(cross(e, f)) <= tolerance * std::max(norm(e), norm(f)))) return 3;
    n = 2;
  }
  if (n == 2 && norm(hull.point[1].w - o) <= tolerance) n = 1;
  return n;
}

// Directions out of the span of the first n points, opposite ones among them.
int directions_out_of(const Polytope& hull, int n, Vec3* directions) {
  const Vec3 o = hull.point[0].w;
  int count = 0;
  if (n == 1) {
    for (int i = 0; i < 3; ++i) {
      Vec3 d;
      d[i] = 1;
      directions[count++] = d;
      directions[count++] = -d;
    }
  } else if (n == 2) {
    const Vec3 e = normalised(hull.point[1].w - o), u = any_perpendicular(e), v = cross(e, u);
    for (const Vec3& d : {u, v, -u, -v}) directions[count++] = d;
  } else {
    const Vec3 normal = normalised(cross(hull.point[1].w - o, hull.point[2].w - o));
    directions[count++] = normal;
    directions[count++] = -normal;
  }
  return count;
}

// Grows a simplex that holds the origin to a tetrahedron by extreme points. Returns how many points it got:
// fewer than four when the whole difference is flat.
int grow_to_tetrahedron(const Convex& a, const Convex& b, const Simplex& s, double tolerance,
                        Polytope& hull) {
  for (int i = 0; i < s.count; ++i) hull.point[i] = s.point[i];
  int n = independent_points(hull, s.count, tolerance);
  for (; n < 4; ++n) {
    Vec3 directions[6];
    const int tries = directions_out_of(hull, n, directions);
    double farthest = tolerance;
    for (int t = 0; t < tries; ++t) {
      const DifferencePoint p = difference_support(a, b, directions[t]);
      const double distance = dot(directions[t], p.w - hull.point[0].w);
      if (distance > farthest) {
        farthest = distance;
        hull.point[n] = p;
      }
    }
    if (farthest == tolerance) break;
  }
  return n;
}

// Both cores lie in one plane, or on one line: they part across it, at no depth. Here belong a segment that
// cuts a triangle in its own plane, and two spheres on one centre, whose cores are points.
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
// holds it: with its weights the points of a and b that the corners come from give the deepest points.
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

// How far the bounds of the depth may be apart. Flat surfaces are met, round ones approached: triangles much
// finer than this are rounding. Between two smooth bodies sharpen_smooth() does the rest.
double convergence(const Convex& a, const Convex& b, const PairScale& scale, double rounding) {
  const bool smooth = a.kind == Convex::Kind::ellipsoid && b.kind == Convex::Kind::ellipsoid;
  const double relative = smooth ? 1e-5 : is_round(a) || is_round(b) ? 1e-8 : 1e-10;
  return relative * scale.size + rounding;
}

}  // namespace

void penetration(const Convex& a, const Convex& b, const Simplex& simplex, Separation& result) {
  thread_local Polytope hull;
  const PairScale scale = pair_scale(a, b);
  const double rounding = 1e-14 * scale.reach;
  const double converged = convergence(a, b, scale, rounding);

  const int points = grow_to_tetrahedron(a, b, simplex, 100 * rounding, hull);
  if (points < 4) return part_flat(a, b, hull, points, result);
  const Vec3 o = hull.point[0].w;
  hull.rounding = rounding;
  hull.start(dot(cross(hull.point[1].w - o, hull.point[2].w - o), hull.point[3].w - o) < 0);
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
      result.normal = -direction;
      result.distance = -depth;
      result.on_a = p.a;
      result.on_b = p.b;
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
