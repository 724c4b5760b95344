#pragma once
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons::collision {

// A shape where it is: `frame` takes its coordinates into the world.
struct Posed {
  const Shape& shape;
  const Transform& frame;
};

// Appends the contact points of two shapes with a gap of at most `margin` (m), in world coordinates; the
// normals point from b to a. Which kinds a and b may be the rows of table.cpp say.
using PairFunction = void(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points);

}  // namespace amontons::collision
