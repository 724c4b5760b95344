#pragma once
#include "collision/narrow/convex.hpp"

namespace amontons::collision {

// Sharpens the normal of two overlapping bodies of which one is smooth (an ellipsoid); radii are in `s`.
void sharpen_smooth(const Convex& a, const Convex& b, Separation& s);

}  // namespace amontons::collision
