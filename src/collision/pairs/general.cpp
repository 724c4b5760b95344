#include "collision/pairs/general.hpp"

#include "collision/narrow/manifold.hpp"
#include "collision/narrow/separation.hpp"
#include "collision/narrow/surface.hpp"
#include "collision/shapes/height_grid.hpp"
#include "collision/shapes/triangle_mesh.hpp"

namespace amontons::collision {

namespace {

// Known to this file alone, so that the compiler sees that each part of the algorithm is called once.
struct TriangleSurface : MeshSurface {};
struct HeightSurface : GridSurface {};

}  // namespace

void collide_convex(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  // Coordinates about the centre of a: differences of nearby points then keep their digits, however far from
  // the origin of the world the bodies are.
  const Vec3& origin = a.frame.position;
  const Convex body_a = make_convex(a.shape, a.frame, origin), body_b = make_convex(b.shape, b.frame, origin);
  const Separation s = separation(body_a, body_b, margin);
  if (!s.within) return;
  const std::size_t before = points.size();
  manifold(body_a, body_b, s, margin, points);
  for (std::size_t i = before; i < points.size(); ++i) points[i].point += origin;
}

// The pose of the shape relative to the surface is all that matters; collide_surface() works in the
// coordinates of the surface, where its triangles need not be turned, and takes the points back to the world.
void collide_mesh(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const TriangleSurface surface{{*std::get<Mesh>(b.shape).data}};
  collide_surface(surface, b.frame, a.shape, a.frame, margin, points);
}

// The same for a height field, which only finds its triangles in another way.
void collide_height_field(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const HeightSurface surface{{*std::get<HeightField>(b.shape).data}};
  collide_surface(surface, b.frame, a.shape, a.frame, margin, points);
}

}  // namespace amontons::collision
