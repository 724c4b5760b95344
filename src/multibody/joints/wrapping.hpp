#pragma once
#include <optional>

#include "amontons/multibody/model/description.hpp"

// The shortest path of a string around an obstacle, or through it.
namespace amontons {

// First and last contact point of the string with the obstacle, and its length between them; m, world.
struct Wrap {
  Vec3 first, last;
  double length;
};

// A string from a to b past a sphere or an infinite cylinder (`obstacle`, its frame in the world). `side` as
// in PathElement, in the world. Empty if the string is straight: it passes clear of the obstacle on the right
// side, ends within it, or has no path around.
std::optional<Wrap> wrap(const Vec3& a, const Vec3& b, PathElement::Kind kind, const Transform& obstacle,
                         double radius, const std::optional<Vec3>& side);

}  // namespace amontons
