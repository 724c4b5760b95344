#pragma once
#include "collision/pairs/pair.hpp"

// Algorithms for all convex shapes, by support function and supporting features alone.
namespace amontons::collision {

// Any two convex shapes: distance, penetration and clipping.
PairFunction collide_convex;
// Any convex shape on a triangle mesh.
PairFunction collide_mesh;
// Any convex shape on a height field. A shape that has sunk below the surface by at most its own height is
// pushed out.
PairFunction collide_height_field;

}  // namespace amontons::collision
