#include "collision/pairs/table.hpp"

#include <array>

#include "collision/pairs/boxes.hpp"
#include "collision/pairs/general.hpp"
#include "collision/pairs/plane.hpp"
#include "collision/pairs/round.hpp"

namespace amontons::collision {

namespace {

constexpr Kinds near_known = kinds<Sphere, Capsule, Box, Cylinder, Ellipsoid>;

// The first row that holds both kinds serves the pair: special ways first, what always works last. A special
// way needs a reason beyond speed alone, which stands in its row: an exact result where the general way
// iterates, or points that the general way would have to choose among.
constexpr std::array rows{
    PairRow{convex_kinds, kinds<Plane>, collide_plane, "every corner is a constraint of its own"},
    PairRow{convex_kinds, kinds<Mesh>, collide_mesh, "triangle by triangle, normals of active edges only"},
    PairRow{convex_kinds, kinds<HeightField>, collide_height_field, "as a mesh, found by rows and columns"},
    PairRow{kinds<Sphere>, near_known, collide_sphere, "the distance of a point: exact, one point"},
    PairRow{kinds<Capsule>, kinds<Capsule>, collide_capsules, "the distance of two segments: exact"},
    PairRow{kinds<Box>, kinds<Box>, collide_boxes, "separating axes: faster than GJK, exact when resting"},
    PairRow{convex_kinds, convex_kinds, collide_convex, "GJK, EPA and clipping need support functions only"},
};

// The rows by kinds, worked out by the compiler, so that a pair costs one look-up. Only a <= b is filled: the
// caller has put the two shapes in order.
using RowIndex = std::array<std::array<const PairRow*, kind_count>, kind_count>;

constexpr RowIndex make_index() {
  RowIndex index{};
  for (std::size_t a = 0; a < kind_count; ++a)
    for (std::size_t b = a; b < kind_count; ++b)
      for (const PairRow& row : rows)
        if (!index[a][b] && holds(row.a, a) && holds(row.b, b)) index[a][b] = &row;
  return index;
}
constexpr RowIndex index_of_rows = make_index();

}  // namespace

const PairRow* find_row(std::size_t a, std::size_t b) { return index_of_rows[a][b]; }

}  // namespace amontons::collision
