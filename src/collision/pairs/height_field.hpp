#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// Any convex shape on a height field. One that has sunk below the surface by no more than its
// own height is pushed out.
PairFunction collide_height_field;

}  // namespace amontons::collision
