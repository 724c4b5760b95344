#pragma once
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"
#include "amontons/collision/shapes/shapes.hpp"

namespace amontons::collision {

// A shape where it is.
struct Posed {
  const Shape& shape;
  const Transform& frame;
};

// Appends the contact points of two shapes; the normals point from b to a.
using PairFunction = void(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points);

}  // namespace amontons::collision
