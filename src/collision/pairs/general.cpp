#include "collision/pairs/general.hpp"

#include "collision/narrow/manifold.hpp"
#include "collision/narrow/separation.hpp"
#include "collision/narrow/surface.hpp"
#include "collision/shapes/height_grid.hpp"
#include "collision/shapes/triangle_mesh.hpp"

namespace amontons::collision {

namespace {

// Local to this file, so that the compiler sees that each part of the algorithm is called once.
struct TriangleSurface : MeshSurface {};
struct HeightSurface : GridSurface {};

}  // namespace

void collide_convex(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  // Coordinates about the centre of a: differences of nearby points then keep their digits, at any distance
  // of the bodies from the origin of the world.
  const Vec3& origin = a.frame.position;
  const Convex body_a = make_convex(a.shape, a.frame, origin), body_b = make_convex(b.shape, b.frame, origin);
  const Separation s = separation(body_a, body_b, margin);
  if (!s.within) return;
  const std::size_t before = points.size();
  manifold(body_a, body_b, s, margin, points);
  for (std::size_t i = before; i < points.size(); ++i) points[i].point += origin;
}

// Only the pose of the shape relative to the surface matters. collide_surface() works in the coordinates of
// the surface, where its triangles need not be turned, and transforms the points to the world.
void collide_mesh(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const TriangleSurface surface{{*std::get<Mesh>(b.shape).data}};
  collide_surface(surface, b.frame, a.shape, a.frame, margin, points);
}

// The same for a height field, which finds its triangles differently.
void collide_height_field(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  const HeightSurface surface{{*std::get<HeightField>(b.shape).data}};
  collide_surface(surface, b.frame, a.shape, a.frame, margin, points);
}

}  // namespace amontons::collision
