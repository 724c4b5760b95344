#include "collision/pairs/mesh.hpp"

#include "collision/narrow/surface.hpp"
#include "collision/shapes/triangle_mesh.hpp"

namespace amontons::collision {

namespace {

// Known to this file alone, so that the compiler sees that each part of the algorithm is called once.
struct Surface : MeshSurface {};

}  // namespace

void collide_mesh(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const Surface surface{{*std::get<Mesh>(b.shape).data}};
  collide_surface(surface, b.frame, a.shape, a.frame, margin, points);
}

}  // namespace amontons::collision
