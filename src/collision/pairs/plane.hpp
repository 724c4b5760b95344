#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// Any convex shape on a plane: every corner of the side that faces the plane.
PairFunction collide_plane;

}  // namespace amontons::collision
