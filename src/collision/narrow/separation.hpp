#pragma once
#include "collision/narrow/convex.hpp"

namespace amontons::collision {

// The distance of two bodies, by GJK between the cores, or their depth, by EPA if those touch or overlap. Not
// `within` if the distance exceeds `limit` (m), which costs less to find than the distance.
Separation separation(const Convex& a, const Convex& b, double limit);

}  // namespace amontons::collision
