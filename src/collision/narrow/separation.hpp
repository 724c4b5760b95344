#pragma once
#include "collision/narrow/convex.hpp"

namespace amontons::collision {

// The distance of two bodies, by GJK between the cores, or their depth, by EPA where those touch or overlap.
Separation separation(const Convex& a, const Convex& b, double limit);

}  // namespace amontons::collision
