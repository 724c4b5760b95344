#pragma once
#include "collision/narrow/gjk.hpp"

namespace amontons::collision {

// The shortest translation that separates two cores that overlap or touch, by the expanding polytope
// algorithm. The simplex is the one in which GJK found the origin. `result` does not include the radii yet.
void penetration(const Convex& a, const Convex& b, const Simplex& simplex, Separation& result);

}  // namespace amontons::collision
