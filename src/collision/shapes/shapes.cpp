#include "amontons/collision/shapes/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "amontons/base/error.hpp"
#include "collision/shapes/height_grid.hpp"
#include "collision/shapes/triangle_mesh.hpp"

// The functions of each shape: whether its sizes are valid, its largest distance from the origin, the box
// around it, its mass properties at unit density. A new shape adds its four functions here; std::visit
// selects them by overload.
//
// The box around a convex body extends from its centre along the axis e_i by its support function
//   h(d) = max { <d, p> : p in the body }
// in the direction R' e_i, where R turns the body into the world: R' e_i is row i of R. For a body that is
// symmetric about its centre h(d) = h(-d), so that one value per axis suffices.
namespace amontons {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
using std::numbers::pi;

// `what` names the shape and the size, so that the message says which number of a scene is wrong.
void require_size(double value, const char* what) {
  AMONTONS_REQUIRE(std::isfinite(value) && value > 0,
                   std::string(what) + " must be positive and finite, not " + std::to_string(value));
}
void require_sizes(const Vec3& values, const char* what) {
  for (int i = 0; i < 3; ++i) require_size(values[i], what);
}

// `reach` is the support function of a body that is symmetric about its centre.
Aabb symmetric_box(const Transform& frame, auto&& reach) {
  const Mat3 r = to_matrix(frame.rotation);
  const Vec3 half{reach(r.row[0]), reach(r.row[1]), reach(r.row[2])};
  return {frame.position - half, frame.position + half};
}

// The same two functions for shapes within a box of their own frame.
double radius_of(const Aabb& local) {
  Vec3 far;
  for (int i = 0; i < 3; ++i) far[i] = std::max(std::abs(local.lower[i]), std::abs(local.upper[i]));
  return norm(far);
}
// The support function of a box about its centre is sum_i h_i |d_i|, for d in the box's own axes.
Aabb box_of(const Aabb& local, const Transform& frame) {
  const Vec3 h = 0.5 * (local.upper - local.lower);
  const Vec3 centre = 0.5 * (local.lower + local.upper);
  return symmetric_box({frame(centre), frame.rotation}, [&](const Vec3& d) {
    return std::abs(d.x) * h.x + std::abs(d.y) * h.y + std::abs(d.z) * h.z;
  });
}

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

// Equal in every direction, so that the rotation does not matter.
void check(const Sphere& s) { require_size(s.radius, "sphere: the radius"); }
double radius_of(const Sphere& s) { return s.radius; }
Aabb box_of(const Sphere& s, const Transform& frame) {
  return symmetric_box(frame, [&](const Vec3&) { return s.radius; });
}
MassProperties solid_of(const Sphere& s) {
  const double m = 4 / 3.0 * pi * s.radius * s.radius * s.radius, i = 0.4 * m * s.radius * s.radius;
  return principal(m, i, i, i);
}

void check(const Capsule& s) {
  require_size(s.radius, "capsule: the radius");
  require_size(s.half_length, "capsule: the half length");
}
double radius_of(const Capsule& s) { return s.half_length + s.radius; }
// A segment with a ball around every point: the support functions of a sum of sets add.
Aabb box_of(const Capsule& s, const Transform& frame) {
  return symmetric_box(frame, [&](const Vec3& d) { return std::abs(d.z) * s.half_length + s.radius; });
}
// A tube and two half balls, whose centres are 3/8 r from their flat faces.
MassProperties solid_of(const Capsule& s) {
  const double r = s.radius, h = s.half_length;
  const double tube = 2 * pi * r * r * h, caps = 4 / 3.0 * pi * r * r * r;
  const double across = tube * (r * r / 4 + h * h / 3) + caps * (0.4 * r * r + h * h + 0.75 * h * r);
  return principal(tube + caps, across, across, tube * r * r / 2 + caps * 0.4 * r * r);
}

void check(const Box& s) { require_sizes(s.half, "box: every half edge"); }
// The corners are farthest.
double radius_of(const Box& s) { return norm(s.half); }
Aabb box_of(const Box& s, const Transform& frame) { return box_of(Aabb{-s.half, s.half}, frame); }

void check(const Cylinder& s) {
  require_size(s.radius, "cylinder: the radius");
  require_size(s.half_length, "cylinder: the half length");
}
MassProperties solid_of(const Box& s) {
  const Vec3& h = s.half;
  const double m = 8 * h.x * h.y * h.z, xx = h.x * h.x, yy = h.y * h.y, zz = h.z * h.z;
  return principal(m, m / 3 * (yy + zz), m / 3 * (xx + zz), m / 3 * (xx + yy));
}
// The rims are farthest.
double radius_of(const Cylinder& s) { return std::sqrt(s.radius * s.radius + s.half_length * s.half_length); }
// A segment along z and a disc across it: |d_z| l + r |(d_x, d_y)|.
Aabb box_of(const Cylinder& s, const Transform& frame) {
  return symmetric_box(frame, [&](const Vec3& d) {
    return std::abs(d.z) * s.half_length + s.radius * std::sqrt(d.x * d.x + d.y * d.y);
  });
}
MassProperties solid_of(const Cylinder& s) {
  const double r = s.radius, h = s.half_length, m = 2 * pi * r * r * h;
  const double across = m * (r * r / 4 + h * h / 3);
  return principal(m, across, across, m * r * r / 2);
}

void check(const Ellipsoid& s) { require_sizes(s.radii, "ellipsoid: every semi-axis"); }
double radius_of(const Ellipsoid& s) { return std::max({s.radii.x, s.radii.y, s.radii.z}); }
// A ball stretched by the semi-axes r: h(d) = |(r_x d_x, r_y d_y, r_z d_z)|.
Aabb box_of(const Ellipsoid& s, const Transform& frame) {
  return symmetric_box(
      frame, [&](const Vec3& d) { return norm(Vec3{d.x * s.radii.x, d.y * s.radii.y, d.z * s.radii.z}); });
}
MassProperties solid_of(const Ellipsoid& s) {
  const Vec3& r = s.radii;
  const double m = 4 / 3.0 * pi * r.x * r.y * r.z, xx = r.x * r.x, yy = r.y * r.y, zz = r.z * r.z;
  return principal(m, m / 5 * (yy + zz), m / 5 * (xx + zz), m / 5 * (xx + yy));
}

void check(const Hull& s) {
  AMONTONS_REQUIRE(s.data != nullptr, "convex hull is empty; make it with make_hull()");
}
double radius_of(const Hull& s) { return s.data->radius; }
// The tightest box: from the extreme corners along the axes of the frame, which are rows in the axes of the
// hull.
Aabb box_of(const Hull& s, const Transform& frame) {
  const Mat3 r = to_matrix(frame.rotation);
  Aabb box;
  for (int i = 0; i < 3; ++i) {
    box.lower[i] = dot(r.row[i], s.data->vertices[extreme_corner(*s.data, -r.row[i])]);
    box.upper[i] = dot(r.row[i], s.data->vertices[extreme_corner(*s.data, r.row[i])]);
  }
  return {frame.position + box.lower, frame.position + box.upper};
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

// A half space has no size, and in most orientations no box: everything near it is a pair.
void check(const Plane&) {}
double radius_of(const Plane&) { return infinity; }
Aabb box_of(const Plane&, const Transform&) {
  return {{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
}
MassProperties solid_of(const Plane&) {
  throw InputError("a plane has no volume; give the mass of the body by itself");
}

void check(const Mesh& s) {
  AMONTONS_REQUIRE(s.data != nullptr, "triangle mesh is empty; make it with make_mesh()");
}
// The root of the tree has the box around all triangles.
double radius_of(const Mesh& s) { return radius_of(s.data->nodes[0].box); }
Aabb box_of(const Mesh& s, const Transform& frame) { return box_of(s.data->nodes[0].box, frame); }

void check(const HeightField& s) {
  AMONTONS_REQUIRE(s.data != nullptr, "height field is empty; make it with make_height_field()");
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
double radius_of(const HeightField& s) { return radius_of(s.data->box()); }
Aabb box_of(const HeightField& s, const Transform& frame) { return box_of(s.data->box(), frame); }

}  // namespace

// Entry points: each selects the overload for the kind of the shape.
void validate(const Shape& shape) {
  std::visit([](const auto& s) { check(s); }, shape);
}
MassProperties solid_of(const HeightField&) {
  throw InputError("a height field has no volume; give the mass of the body by itself");
}

bool is_static_only(const Shape& shape) { return shape.index() >= Shape(Plane{}).index(); }

double bounding_radius(const Shape& shape) {
  return std::visit([](const auto& s) { return radius_of(s); }, shape);
}

Aabb bounds(const Shape& shape, const Transform& frame) {
  return std::visit([&](const auto& s) { return box_of(s, frame); }, shape);
}

Aabb quick_bounds(const Shape& shape, const Transform& frame) {
  if (const auto* hull = std::get_if<Hull>(&shape)) return box_of(hull->data->box, frame);
  return bounds(shape, frame);
}

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
