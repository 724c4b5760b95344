#pragma once
#include <variant>

#include "amontons/collision/shapes/height_field.hpp"
#include "amontons/collision/shapes/hull.hpp"
#include "amontons/collision/shapes/mesh.hpp"
#include "amontons/collision/shapes/primitives.hpp"

namespace amontons {

// Any shape: the convex ones, then from Plane on those that are static only. Of the two shapes of a pair the
// one that comes first here is treated as the first (pairs/table.cpp).
using Shape = std::variant<Sphere, Capsule, Box, Cylinder, Ellipsoid, Hull, Plane, Mesh, HeightField>;

// Throws InputError naming what is wrong: sizes that are not positive and finite, shapes without data.
void validate(const Shape& shape);

// Only fixed bodies may carry these: planes, meshes and height fields. All others are convex.
bool is_static_only(const Shape& shape);
// The radius of the sphere about the origin of the shape that holds it; infinite for a plane.
double bounding_radius(const Shape& shape);
// The axis-aligned box around the shape in world coordinates; infinite for a plane.
Aabb bounds(const Shape& shape, const Transform& frame);

}  // namespace amontons
