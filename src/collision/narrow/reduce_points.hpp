#pragma once
#include <cstddef>
#include <vector>

#include "amontons/collision/narrow/contact_point.hpp"

namespace amontons::collision {

// Removes points that lie together and, of many with about the same normal, all but the deepest and the
// outermost ones. The points from index `first` on; `length` is the size of the body.
void reduce_points(std::vector<ContactPoint>& points, std::size_t first, double length);

}  // namespace amontons::collision
