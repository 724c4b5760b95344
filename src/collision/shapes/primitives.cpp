#include "amontons/collision/shapes/primitives.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "amontons/base/error.hpp"

// The box around a convex body reaches from its centre along the axis e_i as far as its support function
// h(R' e_i) says, where R turns the body into the world: R' e_i is row i of R.
namespace amontons::collision {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

void require_size(double value, const char* what) {
  AMONTONS_REQUIRE(std::isfinite(value) && value > 0,
                   std::string(what) + " must be positive and finite, not " + std::to_string(value));
}
void require_sizes(const Vec3& values, const char* what) {
  for (int i = 0; i < 3; ++i) require_size(values[i], what);
}

// `reach` is the support function of a body that is symmetric about its centre.
template <class F>
Aabb symmetric_box(const Transform& frame, F&& reach) {
  const Mat3 r = to_matrix(frame.rotation);
  const Vec3 half{reach(r.row[0]), reach(r.row[1]), reach(r.row[2])};
  return {frame.position - half, frame.position + half};
}

}  // namespace

void require_valid(const Sphere& s) { require_size(s.radius, "sphere: the radius"); }
double radius_about_origin(const Sphere& s) { return s.radius; }
Aabb box_around(const Sphere& s, const Transform& frame) {
  const Vec3 half{s.radius, s.radius, s.radius};
  return {frame.position - half, frame.position + half};
}

void require_valid(const Capsule& s) {
  require_size(s.radius, "capsule: the radius");
  require_size(s.half_length, "capsule: the half length");
}
double radius_about_origin(const Capsule& s) { return s.half_length + s.radius; }
Aabb box_around(const Capsule& s, const Transform& frame) {
  return symmetric_box(frame, [&](const Vec3& d) { return std::abs(d.z) * s.half_length + s.radius; });
}

void require_valid(const Box& s) { require_sizes(s.half, "box: every half edge"); }
double radius_about_origin(const Box& s) { return norm(s.half); }
Aabb box_around(const Box& s, const Transform& frame) { return box_around(Aabb{-s.half, s.half}, frame); }

void require_valid(const Cylinder& s) {
  require_size(s.radius, "cylinder: the radius");
  require_size(s.half_length, "cylinder: the half length");
}
double radius_about_origin(const Cylinder& s) {
  return std::sqrt(s.radius * s.radius + s.half_length * s.half_length);
}
Aabb box_around(const Cylinder& s, const Transform& frame) {
  return symmetric_box(frame, [&](const Vec3& d) {
    return std::abs(d.z) * s.half_length + s.radius * std::sqrt(d.x * d.x + d.y * d.y);
  });
}

void require_valid(const Ellipsoid& s) { require_sizes(s.radii, "ellipsoid: every semi-axis"); }
double radius_about_origin(const Ellipsoid& s) { return std::max({s.radii.x, s.radii.y, s.radii.z}); }
Aabb box_around(const Ellipsoid& s, const Transform& frame) {
  // A ball stretched by the semi-axes r: h(d) = |(r_x d_x, r_y d_y, r_z d_z)|.
  return symmetric_box(
      frame, [&](const Vec3& d) { return norm(Vec3{d.x * s.radii.x, d.y * s.radii.y, d.z * s.radii.z}); });
}

void require_valid(const Plane&) {}
double radius_about_origin(const Plane&) { return infinity; }
Aabb box_around(const Plane&, const Transform&) {
  return {{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
}

double radius_about_origin(const Aabb& local) {
  Vec3 far;
  for (int i = 0; i < 3; ++i) far[i] = std::max(std::abs(local.lower[i]), std::abs(local.upper[i]));
  return norm(far);
}

// The support function of a box about its centre is sum_i h_i |d_i|, the box's own axes being those of d.
Aabb box_around(const Aabb& local, const Transform& frame) {
  const Vec3 h = 0.5 * (local.upper - local.lower);
  const Vec3 centre = 0.5 * (local.lower + local.upper);
  return symmetric_box({frame(centre), frame.rotation}, [&](const Vec3& d) {
    return std::abs(d.x) * h.x + std::abs(d.y) * h.y + std::abs(d.z) * h.z;
  });
}

}  // namespace amontons::collision
