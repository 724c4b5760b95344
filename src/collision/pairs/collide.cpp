#include "amontons/collision/pairs/collide.hpp"

#include <array>
#include <tuple>

#include "collision/narrow/manifold.hpp"
#include "collision/pairs/boxes.hpp"
#include "collision/pairs/general.hpp"
#include "collision/pairs/plane.hpp"
#include "collision/pairs/round.hpp"

// A table of the algorithm for each pair of shapes, and collide(), which looks it up.
namespace amontons {
namespace collision {

namespace {

// Shapes whose distance from a point has a closed form, or for ellipsoids a root that Newton's method finds.
constexpr Kinds near_known = kinds<Capsule, Box, Cylinder, Ellipsoid>;

// The first row that contains both kinds serves the pair: special algorithms first, the general ones last. A
// special algorithm needs a reason beyond speed, which its row states. That is an exact result where the
// general one iterates, or points among which the general one would have to choose.
constexpr std::array rows{
    PairRow{convex_kinds, kinds<Plane>, collide_plane, "every corner is a constraint of its own"},
    PairRow{convex_kinds, kinds<Mesh>, collide_mesh, "triangle by triangle, normals of active edges only"},
    PairRow{convex_kinds, kinds<HeightField>, collide_height_field, "as a mesh, found by rows and columns"},
    PairRow{kinds<Sphere>, kinds<Sphere>, collide_spheres, "the distance of two points: no turn changes it"},
    PairRow{kinds<Sphere>, near_known, collide_sphere, "the distance of a point: exact, one point"},
    PairRow{kinds<Capsule>, kinds<Capsule>, collide_capsules, "the distance of two segments: exact"},
    PairRow{kinds<Box>, kinds<Box>, collide_boxes, "separating axes: faster than GJK, exact when resting"},
    PairRow{convex_kinds, convex_kinds, collide_convex, "GJK, EPA and clipping need support functions only"},
};

// The row for each pair of kinds, computed by the compiler, so that a pair costs one look-up. Only a <= b is
// filled: the caller has ordered the two shapes.
constexpr auto index_of_rows = [] {
  std::array<std::array<const PairRow*, kind_count>, kind_count> index{};
  for (std::size_t a = 0; a < kind_count; ++a)
    for (std::size_t b = a; b < kind_count; ++b)
      for (const PairRow& row : rows)
        if (!index[a][b] && holds(row.a, a) && holds(row.b, b)) index[a][b] = &row;
  return index;
}();

// An order of poses, for two shapes of one kind: by position, then by rotation. Equal poses keep the order of
// the caller.
bool comes_after(const Transform& a, const Transform& b) {
  const auto key = [](const Transform& t) {
    const auto& [p, q] = t;
    return std::tie(p.x, p.y, p.z, q.w, q.x, q.y, q.z);
  };
  return key(a) > key(b);
}

}  // namespace

const PairRow* find_row(std::size_t a, std::size_t b) { return index_of_rows[a][b]; }

}  // namespace collision

// Every pair is treated in one order, so that swapping the shapes does not change the result, not even its
// last bits. The order is by kind in the order of Shape, shapes of one kind by their poses. The normals of a
// swapped pair are reversed; points and gaps are symmetric.
void collide(const Shape& a, const Transform& frame_a, const Shape& b, const Transform& frame_b,
             double margin, std::vector<ContactPoint>& points) {
  const std::size_t kind_a = a.index(), kind_b = b.index();
  const bool swap = kind_a != kind_b ? kind_a > kind_b : collision::comes_after(frame_a, frame_b);
  const collision::Posed first{swap ? b : a, swap ? frame_b : frame_a};
  const collision::Posed second{swap ? a : b, swap ? frame_a : frame_b};
  const collision::PairRow* row = collision::find_row(first.shape.index(), second.shape.index());
  if (!row) return;
  const std::size_t before = points.size();
  row->collide(first, second, margin, points);
  if (!swap) return;
  for (std::size_t i = before; i < points.size(); ++i) points[i].normal = -points[i].normal;
}

void collide_along(const Vec3& normal, const collision::Posed& a, const collision::Posed& b, double margin,
                   std::vector<ContactPoint>& points) {
  const Vec3& origin = a.frame.position;
  const std::size_t before = points.size();
  collision::clip_features(collision::make_convex(a.shape, a.frame, origin),
                           collision::make_convex(b.shape, b.frame, origin), normal, nullptr, margin, points);
  for (std::size_t i = before; i < points.size(); ++i) points[i].point += origin;
}

}  // namespace amontons
