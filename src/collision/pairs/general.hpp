#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// Any two convex shapes, by their support functions and supporting features alone: distance,
// penetration and clipping.
PairFunction collide_convex;

}  // namespace amontons::collision
