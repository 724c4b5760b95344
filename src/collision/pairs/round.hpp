#pragma once
#include "collision/pairs/pair.hpp"

// Pairs of round shapes that have closed forms.
namespace amontons::collision {

// Two spheres: the distance of two points.
PairFunction collide_spheres;
// A sphere and a capsule, box, cylinder or ellipsoid: shapes with a known distance from a point.
PairFunction collide_sphere;
// Two capsules: the distance of two segments.
PairFunction collide_capsules;

}  // namespace amontons::collision
