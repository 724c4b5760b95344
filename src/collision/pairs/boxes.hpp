#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// Two boxes, by separating axes.
PairFunction collide_boxes;

}  // namespace amontons::collision
