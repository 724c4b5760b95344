#include "amontons/collision/rays/ray.hpp"
#include "amontons/collision/shapes/shapes.hpp"
#include "check.hpp"
#include "collision_scenes.hpp"

// Mass, centre and inertia of shapes against sums over points inside, which know no formula.
using namespace scenes;

namespace {

void check_near(const MassProperties& a, const MassProperties& b, double mass, double length, double share) {
  CHECK_NEAR(a.mass, b.mass, share * mass);
  CHECK_NEAR(norm(a.centre_of_mass - b.centre_of_mass), 0, share * length);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) CHECK_NEAR(a.inertia(i, j), b.inertia(i, j), share * mass * length * length);
}

// Cells of a grid whose middle is inside: a point is inside where a ray from it along an axis leaves the
// shape towards the outer side.
MassProperties sum_of_cells(const Shape& shape, int cells) {
  const Aabb box = bounds(shape, {});
  const Vec3 edge = (box.upper - box.lower) / cells;
  MassProperties sum;
  const double volume = edge.x * edge.y * edge.z;
  const Mat3 own =
      (volume / 12) * Mat3::diagonal(edge.y * edge.y + edge.z * edge.z, edge.x * edge.x + edge.z * edge.z,
                                     edge.x * edge.x + edge.y * edge.y);
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j)
      for (int k = 0; k < cells; ++k) {
        const Vec3 p = box.lower + Vec3{(i + 0.5) * edge.x, (j + 0.5) * edge.y, (k + 0.5) * edge.z};
        const RayHit hit = cast_ray(shape, {p, {0, 0, 1}});
        if (hit.distance < INFINITY && hit.normal.z > 0) sum = sum + MassProperties{volume, p, own};
      }
  return sum;
}

}  // namespace

// Fails if the formula of a shape is another one's, or a hull is not integrated over all of its faces. A grid
// of n cells an axis misses the surface by half a cell at most, and by much less on average: 3/n of each is
// room enough, and half of what a wrong factor of 2/5 for 1/2 would give at n = 32.
TEST(mass_of_shapes_is_that_of_their_points) {
  for (const Shape& shape :
       {Shape{Sphere{0.7}}, Shape{Capsule{0.3, 0.5}}, Shape{Box{{0.3, 0.5, 0.2}}}, Shape{Cylinder{0.4, 0.6}},
        Shape{Ellipsoid{{0.3, 0.6, 0.9}}}, Shape{box_hull({0.4, 0.2, 0.6})}, Shape{prism(7, 0.5, 0.3)}}) {
    const MassProperties cells = sum_of_cells(shape, 32), solid = mass_properties(shape);
    check_near(solid, cells, solid.mass, bounding_radius(shape), 3.0 / 32);
    check_near(mass_properties(shape, 800), {800 * solid.mass, solid.centre_of_mass, 800 * solid.inertia},
               800 * solid.mass, bounding_radius(shape), 1e-15);
  }
}

// Fails if the sum over triangles forgets the shift of its origin, the centre, or turns a product of inertia
// round: a box as a hull, far from the origin of its frame, is the closed form moved there, to rounding of
// the corners (1e-16 of 30 m over 0.2 m, cubed by the volume: 1e-13).
TEST(mass_of_a_hull_far_from_its_origin) {
  const Vec3 half{0.4, 0.2, 0.6};
  const Transform there{{30, -20, 10}, normalised({1, 2, 3, 4})};
  std::vector<Vec3> corners = scenes::box_corners(half);
  for (Vec3& corner : corners) corner = there(corner);
  const MassProperties hull = mass_properties(make_hull(corners, scenes::box_faces)),
                       mesh = mass_properties(make_mesh(corners, scenes::box_faces)),
                       box = moved(mass_properties(Box{half}), there);
  check_near(hull, box, box.mass, 1, 1e-12);
  check_near(mesh, box, box.mass, 1, 1e-12);
}

// Fails if two solids do not add up to the one that they make: halves of a box, by the parallel axis theorem.
TEST(solids_add_up) {
  const MassProperties half = mass_properties(Box{{0.1, 0.2, 0.3}}, 500),
                       sum = moved(half, {{-0.1, 0, 0}, {}}) + moved(half, {{0.1, 0, 0}, {}});
  check_near(sum, mass_properties(Box{{0.2, 0.2, 0.3}}, 500), sum.mass, 0.3, 1e-15);
}

// Fails if a shape without an inside gets a mass, or a density that is none is taken.
TEST(mass_needs_a_volume) {
  CHECK_THROWS(mass_properties(Plane{}), "no volume");
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<std::array<std::int32_t, 3>> triangles{{0, 1, 2}};
  CHECK_THROWS(mass_properties(make_mesh(corners, triangles)), "closed");
  CHECK_THROWS(mass_properties(Sphere{-1}), "radius");
  CHECK_THROWS(mass_properties(Sphere{1}, NAN), "density");
}
