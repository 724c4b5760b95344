#pragma once
#include "collision/narrow/convex.hpp"

namespace amontons::collision {

// The distance of two bodies, by GJK between the cores, or their depth, by EPA where those touch or overlap.
// Not `within` if they are farther apart than `limit` (m), which is cheaper to find than the distance.
Separation separation(const Convex& a, const Convex& b, double limit);

}  // namespace amontons::collision
