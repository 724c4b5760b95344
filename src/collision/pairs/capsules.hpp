#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// Two capsules: the distance of two segments.
PairFunction collide_capsules;

}  // namespace amontons::collision
