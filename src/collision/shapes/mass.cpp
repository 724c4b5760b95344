#include "amontons/collision/shapes/mass.hpp"

#include <numbers>

#include "amontons/base/error.hpp"
#include "collision/shapes/triangle_mesh.hpp"

namespace amontons {
namespace {

using std::numbers::pi;

// A solid of unit density whose centre is the origin and whose principal axes are those of the frame.
MassProperties principal(double mass, double xx, double yy, double zz) {
  return {mass, {}, Mat3::diagonal(xx, yy, zz)};
}

// a b'
Mat3 outer(const Vec3& a, const Vec3& b) { return {{a.x * b, a.y * b, a.z * b}}; }
// The inertia of a second moment of mass S, the integral of x x': trace(S) 1 - S.
Mat3 inertia_of(const Mat3& S) {
  const double trace = S(0, 0) + S(1, 1) + S(2, 2);
  return Mat3::diagonal(trace, trace, trace) + -1.0 * S;
}
// Removes the asymmetry of rounding.
Mat3 symmetric(const Mat3& m) { return 0.5 * (m + transposed(m)); }

// The integrals over a polyhedron whose triangles are counter-clockwise seen from outside. They are sums over
// the signed tetrahedra between the triangles and a point inside (Lien and Kajiya, "A symbolic method for
// calculating the integral properties of arbitrary nonconvex polyhedra", 1984). With corners a, b, c and the
// origin, the integral of x x' is V / 20 (aa' + bb' + cc' + ss'), s = a + b + c, and that of x is V / 4 s.
// The point is the middle of the box around the corners, because far from it the sums would cancel.
struct Polyhedron {
  Vec3 origin;
  double volume = 0;
  Vec3 first;
  Mat3 second{};

  explicit Polyhedron(const Aabb& box) : origin(0.5 * (box.lower + box.upper)) {}
  void add(const Vec3& p, const Vec3& q, const Vec3& r) {
    const Vec3 a = p - origin, b = q - origin, c = r - origin, s = a + b + c;
    const double v = dot(a, cross(b, c)) / 6;
    volume += v;
    first += (v / 4) * s;
    second = second + (v / 20) * (outer(a, a) + outer(b, b) + outer(c, c) + outer(s, s));
  }
  MassProperties solid() const {
    const Vec3 centre = first / volume;
    return {volume, centre + origin, symmetric(inertia_of(second + -volume * outer(centre, centre)))};
  }
};

MassProperties solid_of(const Sphere& s) {
  const double m = 4 / 3.0 * pi * s.radius * s.radius * s.radius, i = 0.4 * m * s.radius * s.radius;
  return principal(m, i, i, i);
}

// A tube and two half balls, whose centres are 3/8 r from their flat faces.
MassProperties solid_of(const Capsule& s) {
  const double r = s.radius, h = s.half_length;
  const double tube = 2 * pi * r * r * h, caps = 4 / 3.0 * pi * r * r * r;
  const double across = tube * (r * r / 4 + h * h / 3) + caps * (0.4 * r * r + h * h + 0.75 * h * r);
  return principal(tube + caps, across, across, tube * r * r / 2 + caps * 0.4 * r * r);
}

MassProperties solid_of(const Box& s) {
  const Vec3& h = s.half;
  const double m = 8 * h.x * h.y * h.z, xx = h.x * h.x, yy = h.y * h.y, zz = h.z * h.z;
  return principal(m, m / 3 * (yy + zz), m / 3 * (xx + zz), m / 3 * (xx + yy));
}

MassProperties solid_of(const Cylinder& s) {
  const double r = s.radius, h = s.half_length, m = 2 * pi * r * r * h;
  const double across = m * (r * r / 4 + h * h / 3);
  return principal(m, across, across, m * r * r / 2);
}

MassProperties solid_of(const Ellipsoid& s) {
  const Vec3& r = s.radii;
  const double m = 4 / 3.0 * pi * r.x * r.y * r.z, xx = r.x * r.x, yy = r.y * r.y, zz = r.z * r.z;
  return principal(m, m / 5 * (yy + zz), m / 5 * (xx + zz), m / 5 * (xx + yy));
}

// Each face as a fan of triangles about its first corner.
MassProperties solid_of(const Hull& s) {
  const ConvexHull& hull = *s.data;
  Polyhedron sum(hull.box);
  for (const auto& face : hull.faces)
    for (std::size_t k = 2; k < face.size(); ++k)
      sum.add(hull.vertices[face[0]], hull.vertices[face[k - 1]], hull.vertices[face[k]]);
  return sum.solid();
}

MassProperties solid_of(const Mesh& s) {
  const TriangleMesh& mesh = *s.data;
  Polyhedron sum(mesh.nodes[0].box);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    sum.add(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
  AMONTONS_REQUIRE(sum.volume > 0,
                   "mesh: the triangles enclose no volume; they must be closed and face outwards");
  return sum.solid();
}

MassProperties solid_of(const Plane&) {
  throw InputError("a plane has no volume; give the mass of the body by itself");
}
MassProperties solid_of(const HeightField&) {
  throw InputError("a height field has no volume; give the mass of the body by itself");
}

}  // namespace

MassProperties mass_properties(const Shape& shape, double density) {
  validate(shape);
  AMONTONS_REQUIRE(density > 0 && std::isfinite(density), "density must be positive and finite (kg/m^3)");
  MassProperties solid = std::visit([](const auto& s) { return solid_of(s); }, shape);
  if (density != 1) solid.mass *= density, solid.inertia = density * solid.inertia;
  return solid;
}

MassProperties moved(const MassProperties& solid, const Transform& frame) {
  const Mat3 R = to_matrix(frame.rotation);
  return {solid.mass, frame(solid.centre_of_mass), symmetric(R * solid.inertia * transposed(R))};
}

// The parallel axis theorem: a part of mass m whose centre lies d from the common one adds the inertia of its
// second moment m d d'.
MassProperties operator+(const MassProperties& a, const MassProperties& b) {
  const double mass = a.mass + b.mass;
  if (mass == 0) return a;
  const Vec3 centre = (a.mass * a.centre_of_mass + b.mass * b.centre_of_mass) / mass;
  MassProperties sum{mass, centre, a.inertia + b.inertia};
  for (const MassProperties* part : {&a, &b}) {
    const Vec3 d = part->centre_of_mass - centre;
    sum.inertia = sum.inertia + part->mass * inertia_of(outer(d, d));
  }
  return sum;
}

}  // namespace amontons
