#include "amontons/collision/shapes/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "amontons/base/error.hpp"
#include "collision/pairs/height_field.hpp"
#include "collision/pairs/mesh.hpp"

namespace amontons {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

void require_size(double value, const char* what) {
  AMONTONS_REQUIRE(std::isfinite(value) && value > 0,
                   std::string(what) + " must be positive and finite, not " + std::to_string(value));
}
void require_sizes(const Vec3& values, const char* what) {
  for (int i = 0; i < 3; ++i) require_size(values[i], what);
}
template <class T>
void require_data(const std::shared_ptr<T>& data, const char* what, const char* maker) {
  AMONTONS_REQUIRE(data != nullptr, std::string(what) + " is empty; make it with " + maker + "()");
}

// The sphere about the origin and the box in the world of what a local box holds.
double radius_of(const Aabb& box) {
  Vec3 far;
  for (int i = 0; i < 3; ++i) far[i] = std::max(std::abs(box.lower[i]), std::abs(box.upper[i]));
  return norm(far);
}
Aabb around(const Vec3& centre, const Vec3& half) { return {centre - half, centre + half}; }

Aabb turned(const Aabb& box, const Transform& frame, const Mat3& r) {
  const Vec3 h = 0.5 * (box.upper - box.lower);
  Vec3 half;
  for (int i = 0; i < 3; ++i)
    half[i] = std::abs(r(i, 0)) * h.x + std::abs(r(i, 1)) * h.y + std::abs(r(i, 2)) * h.z;
  return around(frame(0.5 * (box.lower + box.upper)), half);
}

}  // namespace

void validate(const Shape& shape) {
  std::visit(
      Overloaded{[](const Sphere& s) { require_size(s.radius, "sphere: the radius"); },
                 [](const Box& s) { require_sizes(s.half, "box: every half edge"); },
                 [](const Capsule& s) {
                   require_size(s.radius, "capsule: the radius");
                   require_size(s.half_length, "capsule: the half length");
                 },
                 [](const Cylinder& s) {
                   require_size(s.radius, "cylinder: the radius");
                   require_size(s.half_length, "cylinder: the half length");
                 },
                 [](const Ellipsoid& s) { require_sizes(s.radii, "ellipsoid: every semi-axis"); },
                 [](const Plane&) {}, [](const Hull& s) { require_data(s.data, "convex hull", "make_hull"); },
                 [](const Mesh& s) { require_data(s.data, "triangle mesh", "make_mesh"); },
                 [](const HeightField& s) { require_data(s.data, "height field", "make_height_field"); }},
      shape);
}

bool is_static_only(const Shape& shape) {
  return std::holds_alternative<Plane>(shape) || std::holds_alternative<Mesh>(shape) ||
         std::holds_alternative<HeightField>(shape);
}

double bounding_radius(const Shape& shape) {
  return std::visit(
      Overloaded{
          [](const Sphere& s) { return s.radius; }, [](const Box& s) { return norm(s.half); },
          [](const Capsule& s) { return s.half_length + s.radius; },
          [](const Cylinder& s) { return std::sqrt(s.radius * s.radius + s.half_length * s.half_length); },
          [](const Ellipsoid& s) { return std::max({s.radii.x, s.radii.y, s.radii.z}); },
          [](const Plane&) { return infinity; },
          [](const Hull& s) {
            double squared = 0;
            for (const Vec3& p : s.data->vertices) squared = std::max(squared, norm_squared(p));
            return std::sqrt(squared);
          },
          [](const Mesh& s) { return radius_of(collision::local_bounds(*s.data)); },
          [](const HeightField& s) { return radius_of(collision::local_bounds(*s.data)); }},
      shape);
}

Aabb bounds(const Shape& shape, const Transform& frame) {
  const Mat3 r = to_matrix(frame.rotation);
  const Vec3& centre = frame.position;
  return std::visit(
      Overloaded{[&](const Sphere& s) { return around(centre, {s.radius, s.radius, s.radius}); },
                 [&](const Box& s) { return turned({-s.half, s.half}, frame, r); },
                 [&](const Capsule& s) {
                   Vec3 half;
                   for (int i = 0; i < 3; ++i) half[i] = std::abs(r(i, 2)) * s.half_length + s.radius;
                   return around(centre, half);
                 },
                 [&](const Cylinder& s) {
                   Vec3 half;
                   for (int i = 0; i < 3; ++i)
                     half[i] = std::abs(r(i, 2)) * s.half_length +
                               s.radius * std::sqrt(r(i, 0) * r(i, 0) + r(i, 1) * r(i, 1));
                   return around(centre, half);
                 },
                 [&](const Ellipsoid& s) {
                   Vec3 half;
                   for (int i = 0; i < 3; ++i)
                     half[i] = norm(Vec3{r(i, 0) * s.radii.x, r(i, 1) * s.radii.y, r(i, 2) * s.radii.z});
                   return around(centre, half);
                 },
                 [&](const Plane&) {
                   return Aabb{{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
                 },
                 [&](const Hull& s) {
                   Vec3 lower{infinity, infinity, infinity}, upper = -lower;
                   for (const Vec3& p : s.data->vertices) {
                     const Vec3 q = r * p;
                     for (int i = 0; i < 3; ++i) {
                       lower[i] = std::min(lower[i], q[i]);
                       upper[i] = std::max(upper[i], q[i]);
                     }
                   }
                   return Aabb{centre + lower, centre + upper};
                 },
                 [&](const Mesh& s) { return turned(collision::local_bounds(*s.data), frame, r); },
                 [&](const HeightField& s) { return turned(collision::local_bounds(*s.data), frame, r); }},
      shape);
}

}  // namespace amontons
