#include "collision/pairs/surfaces.hpp"

#include "collision/narrow/surface.hpp"
#include "collision/shapes/height_grid.hpp"
#include "collision/shapes/triangle_mesh.hpp"

namespace amontons::collision {

void collide_mesh(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const MeshSurface surface{*std::get<Mesh>(b.shape).data};
  collide_surface(surface, b.frame, a.shape, a.frame, margin, points);
}

void collide_height_field(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const GridSurface surface{*std::get<HeightField>(b.shape).data};
  collide_surface(surface, b.frame, a.shape, a.frame, margin, points);
}

}  // namespace amontons::collision
