#pragma once
#include <tuple>
#include <variant>

#include "amontons/base/fields.hpp"
#include "amontons/collision/shapes/height_field.hpp"
#include "amontons/collision/shapes/hull.hpp"
#include "amontons/collision/shapes/mesh.hpp"

// Shapes with a few lengths are defined here, those with data of their own in the headers above. Each is
// given in a frame of its own; primitives have their centre at the origin. Lengths are in m. A shape is plain
// data without a mass; functions take its pose as an argument.
namespace amontons {

struct Sphere {
  double radius;
};
struct Capsule {  // the points within `radius` of the segment |z| <= half_length
  double radius, half_length;
};
struct Box {
  Vec3 half;  // half edge lengths
};
struct Cylinder {  // about the z axis, |z| <= half_length
  double radius, half_length;
};
struct Ellipsoid {
  Vec3 radii;  // semi-axes along x, y, z
};
struct Plane {};  // the half space z <= 0; its normal is +z. Static.

// Any shape: the convex ones, then from Plane on those that are static only. The shape of a pair that comes
// first here is treated as the first (pairs/collide.cpp).
using Shape = std::variant<Sphere, Capsule, Box, Cylinder, Ellipsoid, Hull, Plane, Mesh, HeightField>;

namespace detail {
// The name of a shape in files and in Python; those of a few lengths also have a table of fields.
template <class S>
inline constexpr auto shape_name = nullptr;
template <>
inline constexpr auto shape_name<Sphere> = "Sphere";
AMONTONS_FIELDS(Sphere, radius);
template <>
inline constexpr auto shape_name<Capsule> = "Capsule";
AMONTONS_FIELDS(Capsule, radius, half_length);
template <>
inline constexpr auto shape_name<Box> = "Box";
AMONTONS_FIELDS(Box, half);
template <>
inline constexpr auto shape_name<Cylinder> = "Cylinder";
AMONTONS_FIELDS(Cylinder, radius, half_length);
template <>
inline constexpr auto shape_name<Ellipsoid> = "Ellipsoid";
AMONTONS_FIELDS(Ellipsoid, radii);
template <>
inline constexpr auto shape_name<Plane> = "Plane";
template <>
inline constexpr auto fields<Plane> = std::tuple<>();
template <>
inline constexpr auto shape_name<Hull> = "Hull";
template <>
inline constexpr auto shape_name<Mesh> = "Mesh";
template <>
inline constexpr auto shape_name<HeightField> = "HeightField";

// Calls visitor.operator()<S>() for every kind of shape until one returns true; returns whether one did.
template <std::size_t k = 0>
constexpr bool any_shape(auto&& visitor) {
  if constexpr (k == std::variant_size_v<Shape>)
    return false;
  else
    return visitor.template operator()<std::variant_alternative_t<k, Shape>>() || any_shape<k + 1>(visitor);
}
}  // namespace detail

// Throws InputError naming the error: sizes that are not positive and finite, shapes without data.
void validate(const Shape& shape);

// Only fixed and kinematic bodies may have these: planes, meshes and height fields. All others are convex.
bool is_static_only(const Shape& shape);
// The radius of the sphere about the origin of the shape that contains it; infinite for a plane.
double bounding_radius(const Shape& shape);
// The axis-aligned box around the shape in world coordinates; infinite for a plane. `frame` transforms
// coordinates of the shape to the world. For meshes and height fields it is the box around their own turned
// box.
Aabb bounds(const Shape& shape, const Transform& frame);
// The tightest box around the shape that can be found without its corners, of which hulls of scanned parts
// have hundreds: for hulls also the box around their own box.
Aabb quick_bounds(const Shape& shape, const Transform& frame);

// Mass properties of a solid for the equations of motion.
struct MassProperties {
  double mass = 0;      // kg
  Vec3 centre_of_mass;  // m
  Mat3 inertia;         // about the centre of mass, in the axes of that centre, kg m^2
};

// Mass properties of the solid of a density (kg/m^3) that fills the shape, in the frame of the shape. Throws
// InputError for a shape without volume: planes, height fields, meshes that are not closed or face inwards.
MassProperties mass_properties(const Shape& shape, double density = 1);
// The same solid, given in `frame`, in the coordinates of the parent of `frame`.
MassProperties moved(const MassProperties& solid, const Transform& frame);
// Both solids as one.
MassProperties operator+(const MassProperties& a, const MassProperties& b);

namespace collision {
// A shape with its pose: `frame` transforms its coordinates to the world.
struct Posed {
  const Shape& shape;
  const Transform& frame;
};
}  // namespace collision

}  // namespace amontons
