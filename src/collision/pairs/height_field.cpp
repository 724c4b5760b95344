#include "collision/pairs/height_field.hpp"

#include "collision/narrow/surface.hpp"
#include "collision/shapes/height_grid.hpp"

namespace amontons::collision {

namespace {

// Known to this file alone, so that the compiler sees that each part of the algorithm is called once.
struct Surface : GridSurface {};

}  // namespace

void collide_height_field(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const Surface surface{{*std::get<HeightField>(b.shape).data}};
  collide_surface(surface, b.frame, a.shape, a.frame, margin, points);
}

}  // namespace amontons::collision
