#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// Any convex shape on a triangle mesh or a height field (the second one). A shape that has sunk below a
// height field by no more than its own height is pushed out.
PairFunction collide_mesh, collide_height_field;

}  // namespace amontons::collision
