#pragma once
#include "collision/narrow/simplex.hpp"

namespace amontons::collision {

enum class Cores : unsigned char { beyond_limit, apart, overlap };

// The distance of two cores. `apart`: `result` has the distance, the normal and the nearest points, all of
// the cores. `overlap`, touching included: `simplex` holds the origin, up to rounding.
Cores distance_of_cores(const Convex& a, const Convex& b, double limit, Simplex& simplex, Separation& result);

}  // namespace amontons::collision
