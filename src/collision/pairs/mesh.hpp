#pragma once
#include "collision/pairs/pair.hpp"

namespace amontons::collision {

// Any convex shape on a triangle mesh.
PairFunction collide_mesh;

}  // namespace amontons::collision
