#include "collision/pairs/general.hpp"

#include "collision/narrow/manifold.hpp"
#include "collision/narrow/separation.hpp"

namespace amontons::collision {

void collide_convex(const Posed& a, const Posed& b, double margin, std::vector<ContactPoint>& points) {
  // Coordinates about the centre of a, where rounding is least.
  const Vec3& origin = a.frame.position;
  const Convex body_a = make_convex(a.shape, a.frame, origin), body_b = make_convex(b.shape, b.frame, origin);
  const Separation s = separation(body_a, body_b, margin);
  if (!s.within) return;
  const std::size_t before = points.size();
  manifold(body_a, body_b, s, margin, points);
  for (std::size_t i = before; i < points.size(); ++i) points[i].point += origin;
}

}  // namespace amontons::collision
