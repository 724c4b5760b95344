#pragma once
#include "collision/pairs/pair.hpp"

// What serves any convex shape, by its support function and supporting features alone.
namespace amontons::collision {

// Two convex shapes, by distance, penetration and clipping.
PairFunction collide_convex;
// A convex shape on a triangle mesh or a height field. A shape that has sunk below a height field by no more
// than its own height is pushed out.
PairFunction collide_mesh, collide_height_field;

}  // namespace amontons::collision
