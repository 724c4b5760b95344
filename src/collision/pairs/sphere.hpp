#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// A sphere and a shape whose distance from a point is known (narrow/point_distance.hpp).
PairFunction collide_sphere;

}  // namespace amontons::collision
