#include "amontons/collision/pairs/collide.hpp"

#include "collision/pairs/table.hpp"

namespace amontons {

namespace {

// An order of poses, for two shapes of one kind: by position, then by rotation. Two of one kind in one and
// the same pose stay in the order of the caller.
bool comes_after(const Transform& a, const Transform& b) {
  const Vec3 &p = a.position, &q = b.position;
  if (p.x != q.x) return p.x > q.x;
  if (p.y != q.y) return p.y > q.y;
  if (p.z != q.z) return p.z > q.z;
  const Quat &r = a.rotation, &s = b.rotation;
  if (r.w != s.w) return r.w > s.w;
  if (r.x != s.x) return r.x > s.x;
  if (r.y != s.y) return r.y > s.y;
  return r.z > s.z;
}

}  // namespace

// Every pair is treated in one order, so that swapping the shapes cannot change the result, not even its last
// bits: by their kinds in the order of Shape, two of one kind by their poses. The normals of a swapped pair
// are turned round; points and gaps are symmetric.
void collide(const Shape& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
             double margin, std::vector<ContactPoint>& points) {
  const std::size_t kind_a = a.index(), kind_b = b.index();
  const bool swap = kind_a != kind_b ? kind_a > kind_b : comes_after(frame_a, frame_b);
  const collision::Posed first{swap ? b : a, swap ? frame_b : frame_a};
  const collision::Posed second{swap ? a : b, swap ? frame_a : frame_b};
  const collision::PairRow* row = collision::find_row(first.shape.index(), second.shape.index());
  if (!row) return;
  const std::size_t before = points.size();
  row->collide(first, second, margin, points);
  if (!swap) return;
  for (std::size_t i = before; i < points.size(); ++i) points[i].normal = -points[i].normal;
}

}  // namespace amontons
