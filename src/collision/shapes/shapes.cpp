#include "amontons/collision/shapes/shapes.hpp"

namespace amontons {

void validate(const Shape& shape) {
  std::visit([](const auto& s) { collision::require_valid(s); }, shape);
}

bool is_static_only(const Shape& shape) { return shape.index() >= Shape(Plane{}).index(); }

double bounding_radius(const Shape& shape) {
  return std::visit([](const auto& s) { return collision::radius_about_origin(s); }, shape);
}

Aabb bounds(const Shape& shape, const Transform& frame) {
  return std::visit([&](const auto& s) { return collision::box_around(s, frame); }, shape);
}

}  // namespace amontons
