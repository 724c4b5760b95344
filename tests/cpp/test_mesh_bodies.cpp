#include "check.hpp"
#include "collision/narrow/separation.hpp"
#include "mesh_scenes.hpp"

// Meshes of closed bodies, and what holds for every mesh: units, place, order, what is refused.
using namespace meshes;

namespace {

Triangles icosahedron() {
  const double g = 0.5 * (1 + std::sqrt(5.0));
  Triangles t;
  t.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  t.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                 {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                 {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (Vec3& v : t.vertices) v = normalised(v);
  return t;
}

// The angle (rad) between the normal of a contact and the normals that the convex body has at that point: how
// far a corner lies beyond the tangent plane, seen from the point.
double angle_to_normals(const Triangles& body, const ContactPoint& contact) {
  double most = 0;
  const Vec3 on_surface = contact.point - (0.5 * contact.gap) * contact.normal;
  for (const Vec3& v : body.vertices)
    most = std::max(most, dot(contact.normal, v - on_surface) / std::max(norm(v - on_surface), 0.05));
  return most;
}

// How far (m) a convex body reaches into the corners of another one along a normal: what moving it out along
// that normal takes.
double depth_along(const Triangles& body, const collision::Convex& other, const Vec3& normal) {
  double top = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : body.vertices) top = std::max(top, dot(normal, v));
  return top - (dot(normal, collision::support(other, -normal)) - other.radius);
}

// Overlaps, and how many were told with other depths than the least one.
struct Tally {
  int overlaps = 0, other = 0, far = 0;  // far: not within a factor of two
};

// The mesh of a convex body against that body itself, in random poses at given gaps: the exact distance, or
// depth, is that of the two convex bodies.
void check_as_hull(const Triangles& triangles, const Shape& hull, const std::vector<double>& gaps,
                   unsigned seed, Tally& tally) {
  small::Random random(seed);
  const Shape mesh = triangles.mesh();
  const collision::Convex exact = collision::make_convex(hull, {}, {});
  for (const Shape& shape : all_shapes())
    for (int pose = 0; pose < 200; ++pose) {
      Transform frame{{}, random_rotation(random)};
      frame.position = 2.0 * normalised(Vec3{random.normal(), random.normal(), random.normal()});
      const double gap = gaps[pose % gaps.size()];
      collision::Separation s = collision::separation(collision::make_convex(shape, frame, {}), exact, 10);
      frame.position -= (s.distance - gap) * s.normal;
      s = collision::separation(collision::make_convex(shape, frame, {}), exact, 10);
      const auto found = contacts(shape, frame, mesh, std::max(gap, 0.0) + 0.02);
      const double least = least_gap(found);
      // Polygons for round caps are off by 3e-5 of the size of 0.3, and manifolds take the normal of a face
      // whose cosine with the exact one is above 1 - 2e-4, which is an angle of 0.02.
      constexpr double rounding = 5e-5;
      if (gap > 0) CHECK_NEAR(least, s.distance, rounding + 0.02 * gap);
      // Where an edge or a corner overlaps, the normal is that of the shortest way from a place a little
      // outside, which is not always the shortest way out. No contact is deeper than the way along its own.
      const collision::Convex moved = collision::make_convex(shape, frame, {});
      for (const ContactPoint& p : found) {
        CHECK(-p.gap <= depth_along(triangles, moved, p.normal) + 1e-9);
        if (p.gap <= s.distance) CHECK(angle_to_normals(triangles, p) <= 0.1);
      }
      if (s.distance > -rounding) continue;
      ++tally.overlaps;
      tally.other += std::abs(least - s.distance) > 0.1 * std::abs(s.distance);
      tally.far += !(least <= 0.5 * s.distance && least >= 2 * s.distance);
    }
}

}  // namespace

// Ridges, corners and faces of convex bodies: their mesh must act as the bodies themselves do. A normal
// outside the Voronoi region of an edge, or one snapped that should not be, changes the smallest gap. Of
// 80000 overlaps in poses of 25 other seeds, 3.5 % had a depth that differs from the least one by more than a
// tenth, and 0.03 % one that is not within a factor of two: the bounds are above both by enough for any seed.
TEST(mesh_of_a_convex_body_acts_like_it) {
  const Triangles ball = icosahedron(), box = box_mesh({0.7, 0.5, 0.6});
  const Shape hull = make_hull(ball.vertices, ball.triangles);
  Tally tally;
  for (const std::vector<double>& gaps : {std::vector<double>{0.02, 1e-3, 1e-6}, {-1e-6, -1e-3, -5e-3}}) {
    check_as_hull(ball, hull, gaps, 1, tally);
    check_as_hull(refined(refined(ball, false), false), hull, gaps, 2, tally);
    check_as_hull(box, Box{{0.7, 0.5, 0.6}}, gaps, 3, tally);
    check_as_hull(refined(refined(box, false), false), Box{{0.7, 0.5, 0.6}}, gaps, 4, tally);
  }
  CHECK(tally.overlaps > 2500);
  CHECK(tally.other <= 0.06 * tally.overlaps);
  CHECK(tally.far <= 0.005 * tally.overlaps);
}

// The mesh of a box in other units gives the same bits: any length with a dimension inside would show.
TEST(units_do_not_matter) {
  small::Random random(16);
  const Triangles unit = refined(box_mesh({1, 1, 1}), false);
  int touching = 0;
  for (int pose = 0; pose < 100; ++pose) {
    const Quat rotation = random_rotation(random);
    const Vec3 at{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 1.3 + random.uniform(-0.3, 0)};
    const auto expected = contacts(Box{{0.4, 0.3, 0.2}}, {at, rotation}, unit.mesh(), 0.02);
    touching += !expected.empty();
    for (double scale : {0x1p-10, 0x1p10}) {
      Triangles scaled = unit;
      for (Vec3& v : scaled.vertices) v *= scale;
      const auto found =
          contacts(Box{scale * Vec3{0.4, 0.3, 0.2}}, {scale * at, rotation}, scaled.mesh(), 0.02 * scale);
      CHECK(found.size() == expected.size());
      for (std::size_t i = 0; i < std::min(found.size(), expected.size()); ++i) {
        CHECK(found[i].point == scale * expected[i].point && found[i].normal == expected[i].normal);
        CHECK(found[i].gap == scale * expected[i].gap);
      }
    }
  }
  CHECK(touching > 50);
}

// A mesh far from the origin, and one with its triangles in another order, has the same points. Fails if
// contact is computed in coordinates of the world (positions of 1e3 hold 1e-13, directions between close
// points then lose far more than the 1e-10 allowed), or if what one triangle finds hangs on which came
// before.
TEST(place_and_order_of_triangles_do_not_matter) {
  small::Random random(19);
  const Triangles mesh = refined(box_mesh({1, 1, 1}), false);
  Triangles reversed = mesh;
  std::reverse(reversed.triangles.begin(), reversed.triangles.end());
  const Vec3 far{1000, -2000, 500};
  int touching = 0;
  for (const Shape& shape : all_shapes())
    for (int pose = 0; pose < 50; ++pose) {
      const Quat rotation = random_rotation(random);
      const Vec3 at{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0};
      const Vec3 up{0, 0, 1.002 - lowest_point(shape, rotation)};
      const auto expected = contacts(shape, {at + up, rotation}, mesh.mesh(), 0.02);
      const auto moved = contacts(shape, {far + at + up, rotation}, mesh.mesh(), 0.02, {far, {}});
      const auto other = contacts(shape, {at + up, rotation}, reversed.mesh(), 0.02);
      touching += !expected.empty();
      CHECK_NEAR(least_gap(expected), 0.002, 1e-12);
      CHECK(moved.size() == expected.size() && other.size() == expected.size());
      for (const ContactPoint& p : expected) {
        CHECK(has_point(moved, far + p.point, p.gap, 1e-10));
        CHECK(has_point(other, p.point, p.gap, 1e-12));
      }
    }
  CHECK(touching == 300);
}

// What the user can mend is named: fails if one of these slips through to a mesh that acts wrongly, or if the
// message does not say where.
TEST(meshes_that_are_refused) {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 0, 0}};
  const std::vector<Triangle> good{{0, 1, 2}, {1, 3, 2}};
  CHECK(std::holds_alternative<Mesh>(Shape{make_mesh(corners, good)}));
  CHECK_THROWS(make_mesh(corners, std::vector<Triangle>{}), "no triangle");
  CHECK_THROWS(make_mesh(corners, std::vector<Triangle>{{0, 1, 2}, {1, 7, 2}}), "triangle 1 names vertex 7");
  CHECK_THROWS(make_mesh(corners, std::vector<Triangle>{{0, 1, 2}, {0, 1, 4}}), "triangle 1 is degenerate");
  CHECK_THROWS(make_mesh(corners, std::vector<Triangle>{{0, 1, 2}, {3, 3, 2}}), "triangle 1 is degenerate");
  CHECK_THROWS(make_mesh(corners, std::vector<Triangle>{{0, 1, 2}, {1, 2, 3}}), "same direction");
  std::vector<Vec3> broken = corners;
  broken[4].y = std::nan("");
  CHECK_THROWS(make_mesh(broken, good), "vertex 4 is not finite");
  CHECK_THROWS(make_height_field(std::vector<double>(6), 2, 4, 1, 1), "2 rows of 4 heights");
  CHECK_THROWS(make_height_field(std::vector<double>(4), 1, 4, 1, 1), "at least two rows");
  CHECK_THROWS(make_height_field(std::vector<double>(4), 2, 2, 1, -1), "must be positive");
  CHECK_THROWS(make_height_field(std::vector<double>{0, 0, 0, std::nan("")}, 2, 2, 1, 1), "row 1, column 1");
}
