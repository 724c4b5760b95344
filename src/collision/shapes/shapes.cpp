#include "amontons/collision/shapes/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "amontons/base/error.hpp"
#include "collision/shapes/height_grid.hpp"
#include "collision/shapes/triangle_mesh.hpp"

// The functions of each shape: whether its sizes are valid, its largest distance from the origin, the box
// around it. A new shape adds its three functions here; std::visit selects them by overload.
//
// The box around a convex body extends from its centre along the axis e_i by its support function
//   h(d) = max { <d, p> : p in the body }
// in the direction R' e_i, where R turns the body into the world: R' e_i is row i of R. For a body that is
// symmetric about its centre h(d) = h(-d), so that one value per axis suffices.
namespace amontons {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

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

// Equal in every direction, so that the rotation does not matter.
void check(const Sphere& s) { require_size(s.radius, "sphere: the radius"); }
double radius_of(const Sphere& s) { return s.radius; }
Aabb box_of(const Sphere& s, const Transform& frame) {
  return symmetric_box(frame, [&](const Vec3&) { return s.radius; });
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

void check(const Box& s) { require_sizes(s.half, "box: every half edge"); }
// The corners are farthest.
double radius_of(const Box& s) { return norm(s.half); }
Aabb box_of(const Box& s, const Transform& frame) { return box_of(Aabb{-s.half, s.half}, frame); }

void check(const Cylinder& s) {
  require_size(s.radius, "cylinder: the radius");
  require_size(s.half_length, "cylinder: the half length");
}
// The rims are farthest.
double radius_of(const Cylinder& s) { return std::sqrt(s.radius * s.radius + s.half_length * s.half_length); }
// A segment along z and a disc across it: |d_z| l + r |(d_x, d_y)|.
Aabb box_of(const Cylinder& s, const Transform& frame) {
  return symmetric_box(frame, [&](const Vec3& d) {
    return std::abs(d.z) * s.half_length + s.radius * std::sqrt(d.x * d.x + d.y * d.y);
  });
}

void check(const Ellipsoid& s) { require_sizes(s.radii, "ellipsoid: every semi-axis"); }
double radius_of(const Ellipsoid& s) { return std::max({s.radii.x, s.radii.y, s.radii.z}); }
// A ball stretched by the semi-axes r: h(d) = |(r_x d_x, r_y d_y, r_z d_z)|.
Aabb box_of(const Ellipsoid& s, const Transform& frame) {
  return symmetric_box(
      frame, [&](const Vec3& d) { return norm(Vec3{d.x * s.radii.x, d.y * s.radii.y, d.z * s.radii.z}); });
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

// A half space has no size, and in most orientations no box: everything near it is a pair.
void check(const Plane&) {}
double radius_of(const Plane&) { return infinity; }
Aabb box_of(const Plane&, const Transform&) {
  return {{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
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
double radius_of(const HeightField& s) { return radius_of(s.data->box()); }
Aabb box_of(const HeightField& s, const Transform& frame) { return box_of(s.data->box(), frame); }

}  // namespace

// Entry points: each selects the overload for the kind of the shape.
void validate(const Shape& shape) {
  std::visit([](const auto& s) { check(s); }, shape);
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

}  // namespace amontons
