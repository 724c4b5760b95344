#pragma once
#include <optional>

#include "amontons/multibody/model/description.hpp"

// The shortest way of a string around an obstacle, or through it.
namespace amontons {

// Where the string touches the obstacle first and last, and its length between these points; m, world.
struct Wrap {
  Vec3 first, last;
  double length;
};

// A string from a to b past a sphere or a cylinder without ends (`obstacle`, its frame in the world). `side`
// as in PathElement, in the world. Nothing where the string is straight: it passes clear of the obstacle on
// the right side, ends within the obstacle, or has no way round.
std::optional<Wrap> wrap(const Vec3& a, const Vec3& b, PathElement::Kind kind, const Transform& obstacle,
                         double radius, const std::optional<Vec3>& side);

}  // namespace amontons
