#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// Any two convex shapes, by distance, penetration and clipping.
PairFunction collide_convex;

}  // namespace amontons::collision
