#include "amontons/collision/narrow/support_points.hpp"
#include "check.hpp"
#include "collision/narrow/separation.hpp"
#include "collision/shapes/facet.hpp"
#include "mesh_scenes.hpp"

// Meshes and height fields as ground: flat, with a ridge, rounded, with steps.
using namespace meshes;

namespace {

// The points on a mesh or field are those on the plane: no other one, the deepest among them, and for a body
// that lies flat (`all`) every one.
void check_as_on_plane(const Shape& shape, const Transform& frame, const Shape& surface, double margin,
                       bool all) {
  const auto expected = contacts(shape, frame, Plane{}, margin),
             found = contacts(shape, frame, surface, margin);
  CHECK(found.size() == expected.size() || (!all && !found.empty() && found.size() < expected.size()));
  CHECK_NEAR(least_gap(found), least_gap(expected), 1e-9);
  for (const ContactPoint& p : found) {
    CHECK(has_point(expected, p.point, p.gap, 1e-9));
    CHECK_NEAR(norm(p.normal - Vec3{0, 0, 1}), 0, 1e-9);
  }
}

void check_floor(const Shape& surface, unsigned seed) {
  small::Random random(seed);
  for (const Shape& shape : all_shapes())
    for (int pose = 0; pose < 300; ++pose) {
      // Upright and lying (flat faces and lines down), slightly rocked, and in any orientation; gaps of
      // either sign; every fourth pose exactly over a corner or an edge of the cells.
      Quat rotation = exponential({0, 0, random.uniform(0, 2 * pi)});
      if (pose % 4 == 1) rotation = rotation * exponential({pi / 2, 0, 0});
      if (pose % 4 == 2)
        rotation = rotation * exponential({1e-3 * random.normal(), 1e-3 * random.normal(), 0});
      if (pose % 4 == 3) rotation = random_rotation(random);
      const double gap = std::array{0.004, 1e-6, 0.0, -1e-6, -0.01}[pose % 5];
      Vec3 at{random.uniform(-1, 1), random.uniform(-1, 1), gap - lowest_point(shape, rotation)};
      if (pose % 3 == 0) at.x = 0.25 * std::round(at.x / 0.25);
      if (pose % 6 == 0) at.y = 0.25 * std::round(at.y / 0.25);
      check_as_on_plane(shape, {at, rotation}, surface, 0.01, pose % 4 != 3);
    }
}

}  // namespace

// Sliding across the inner edges of a flat floor feels nothing: normals of single triangles, points lost
// between two triangles, or points made by inner edges would show.
TEST(flat_floor_is_a_plane) {
  check_floor(floor_mesh(16, 0.25, 0, 1, [](double, double) { return 0.0; }).mesh(), 1);
  check_floor(floor_mesh(16, 0.25, 0.3, 2, [](double, double) { return 0.0; }).mesh(), 2);
  check_floor(floor_mesh(50, 0.08, 0.3, 3, [](double, double) { return 0.0; }).mesh(),
              3);  // bodies over many
}

// The same for a field, square and with long thin triangles.
TEST(flat_height_field_is_a_plane) {
  check_floor(make_height_field(std::vector<double>(17 * 17, 0.0), 17, 17, 4, 4), 4);
  check_floor(make_height_field(std::vector<double>(9 * 41, 0.0), 9, 41, 4, 4), 5);
}

// A ridge and a valley of two slopes: across the ridge the normal turns with the body through the
// directions between the slopes, in the valley only the normals of the slopes exist. The distance of a
// sphere is exact (closed form).
TEST(ridge_and_valley) {
  for (double slope : {0.3, 0.01, -0.01, -0.3}) {
    const Shape mesh =
        floor_mesh(16, 0.25, 0, 7, [&](double x, double) { return -slope * std::abs(x); }).mesh();
    const double angle = std::atan(slope), radius = 0.2, gap = 0.003;
    for (double t = -0.6; t <= 0.6; t += 0.0137) {
      Vec3 centre{t, 0.31, 0};
      // Height of the centre over the right or left slope, or over the ridge where the foot lies beyond it.
      const double side = t < 0 ? -1 : 1, reach = radius + gap;
      const bool over_ridge = slope > 0 && std::abs(t) < reach * std::sin(angle);
      Vec3 normal{side * std::sin(angle), 0, std::cos(angle)};
      if (over_ridge) normal = {t / reach, 0, std::sqrt(1 - t * t / (reach * reach))};
      centre.z = over_ridge ? reach * normal.z : -slope * std::abs(t) + reach / std::cos(angle);
      const auto points = contacts(Sphere{radius}, {centre, {}}, mesh, 0.01);
      CHECK_NEAR(least_gap(points), gap, 1e-12);
      bool found = false;
      for (const ContactPoint& p : points) {
        found = found || norm(p.normal - normal) < 1e-9;
        CHECK(slope > 0 || std::abs(std::abs(p.normal.x) - std::sin(std::abs(angle))) < 1e-9);
      }
      CHECK(found);
      CHECK(points.size() == 1 || (slope < 0 && points.size() == 2));
    }
  }
}

// A sphere rolling over a gently rounded floor: its only contacts are the closest points of the whole
// surface, with the exact normal; one bump would be a contact deeper than the closest point or a normal off
// the line to the centre.
TEST(rounded_floor_has_no_bumps) {
  const auto dome = [](double x, double y) { return -0.1 * (x * x + y * y); };
  const auto waves = [](double x, double y) { return 0.02 * std::sin(3 * x) * std::cos(2 * y); };
  const Triangles floors[] = {floor_mesh(16, 0.25, 0.3, 8, dome), floor_mesh(16, 0.25, 0.3, 9, waves)};
  small::Random random(10);
  int touching = 0;
  for (const Triangles& floor : floors) {
    const Shape mesh = floor.mesh();
    for (int pose = 0; pose < 500; ++pose) {
      Vec3 centre{random.uniform(-1.5, 1.5), random.uniform(-1.5, 1.5), random.uniform(0.12, 0.2)};
      centre.z += &floor == floors ? dome(centre.x, centre.y) : 0;
      double distance = 10;
      Vec3 closest;
      for (const Triangle& t : floor.triangles) {
        const Vec3 corner[3] = {floor.vertices[t[0]], floor.vertices[t[1]], floor.vertices[t[2]]};
        const Vec3 p = collision::closest_point(corner, centre).at;
        if (norm(p - centre) < distance) {
          distance = norm(p - centre);
          closest = p;
        }
      }
      const auto points = contacts(Sphere{0.18}, {centre, {}}, mesh, 0.005);
      CHECK((distance < 0.185) == !points.empty());
      if (points.empty()) continue;
      ++touching;
      CHECK_NEAR(least_gap(points), distance - 0.18, 1e-12);
      for (const ContactPoint& p : points)
        if (p.gap < distance - 0.18 + 1e-9)
          CHECK_NEAR(norm(p.normal - (centre - closest) / distance), 0, 1e-6);
    }
  }
  CHECK(touching > 100);
}

// The same for bodies with corners and edges: the least gap is the distance from the whole surface.
TEST(bodies_over_a_rounded_floor) {
  const Triangles floor = floor_mesh(12, 0.25, 0.3, 17, [](double x, double y) {
    return 0.03 * std::sin(3 * x) * std::cos(2 * y) - 0.05 * (x * x + y * y);
  });
  const Shape mesh = floor.mesh();
  std::vector<collision::Convex> triangles;
  for (const Triangle& t : floor.triangles)
    triangles.push_back(
        collision::make_triangle(floor.vertices[t[0]], floor.vertices[t[1]], floor.vertices[t[2]]));
  small::Random random(18);
  for (const Shape& shape : all_shapes())
    for (int pose = 0; pose < 200; ++pose) {
      const Quat rotation = pose % 2
                                ? random_rotation(random)
                                : exponential({0.05 * random.normal(), 0.05 * random.normal(), pose * 1.0});
      Transform frame{{random.uniform(-1, 1), random.uniform(-1, 1), 1}, rotation};
      const auto distance = [&] {
        double least = 10;
        for (const collision::Convex& triangle : triangles) {
          const collision::Separation s =
              collision::separation(collision::make_convex(shape, frame, {}), triangle, least);
          if (s.within) least = std::min(least, s.distance);
        }
        return least;
      };
      for (int k = 0; k < 8; ++k) frame.position.z -= distance() - 2e-3;  // never past the surface
      const double exact = distance();
      const auto points = contacts(shape, frame, mesh, 0.02);
      CHECK_NEAR(least_gap(points), exact, 1e-5 + 0.02 * exact);
    }
}

// A box across a step's edge lies on the step although it reaches deep behind the riser; and a
// box pressed into the corner of floor and wall touches both. A wrong face would push it out
// sideways by its whole length.
TEST(steps_and_corners) {
  Triangles step;
  // Tread z = 0 for x < 0, riser down to z = -0.05, lower tread for x > 0; the riser's diagonal hides its
  // upper edge from one of its triangles.
  for (double y : {-2.0, 2.0})
    for (const auto& [x, z] : {std::pair{-3.0, 0.0}, {0.0, 0.0}, {0.0, -0.05}, {3.0, -0.05}})
      step.vertices.push_back({x, y, z});
  for (int k = 0; k < 3; ++k) {
    step.triangles.push_back({k, k + 1, k + 5});
    step.triangles.push_back({k, k + 5, k + 4});
  }
  const Shape mesh = step.mesh();
  for (double depth : {-1e-3, 0.0, 1e-9, 1e-6, 1e-3})
    for (double x : {-0.39, -0.2, 0.0, 0.1, 0.3, 0.39}) {
      const Transform frame{{x, 0.3, 0.2 - depth}, exponential({0, 0, 0.1})};
      const auto points = contacts(Box{{0.4, 0.3, 0.2}}, frame, mesh, 2e-3);
      CHECK(!points.empty());
      for (const ContactPoint& p : points) {
        CHECK_NEAR(norm(p.normal - Vec3{0, 0, 1}), 0, 1e-9);
        CHECK_NEAR(p.gap, -depth, 1e-9);
      }
    }
  // At the foot of the riser: in front of it by `gap`, on the lower tread.
  for (double gap : {1e-3, 1e-6, -1e-6, -1e-3}) {
    const auto points = contacts(Box{{0.4, 0.3, 0.2}}, {{0.4 + gap, 0, 0.15 + gap}, {}}, mesh, 2e-3);
    int up = 0, across = 0;
    for (const ContactPoint& p : points) {
      CHECK_NEAR(p.gap, gap, 1e-9);
      up += norm(p.normal - Vec3{0, 0, 1}) < 1e-9;
      across += norm(p.normal - Vec3{1, 0, 0}) < 1e-9;
    }
    CHECK(up == 4 && across >= 2 && up + across == static_cast<int>(points.size()));
  }
}

// A box over hundreds of triangles: four corners on a plane; on a bumpy floor a point per triangle within the
// margin, of which a few hold it (support_points.hpp), the deepest among them. Fails if inner edges of a flat
// floor give points, or if bumps beside the deepest are all taken or all left out.
TEST(few_points_over_many_triangles) {
  const Shape box = Box{{1, 1, 0.1}};
  const Shape flat = floor_mesh(60, 0.05, 0.3, 11, [](double, double) { return 0.0; }).mesh();
  CHECK(contacts(box, {{0.01, 0.02, 0.1}, exponential({0, 0, 0.3})}, flat, 0.01).size() == 4);
  const Shape bumpy = floor_mesh(60, 0.05, 0.3, 12, [](double x, double y) {
                        return 1e-3 * std::sin(20 * x) * std::sin(20 * y);
                      }).mesh();
  const auto points = contacts(box, {{0.01, 0.02, 0.1005}, exponential({0, 0, 0.3})}, bumpy, 0.02);
  CHECK(points.size() > 500);
  std::vector<SupportPoint> support;
  for (const ContactPoint& p : points) support.push_back({p.point, p.gap, p.gap});
  std::vector<unsigned char> kept(points.size(), 0);
  SupportPoints().select(support, {0, 0, 1}, 2e-4, kept);
  std::vector<ContactPoint> few;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (kept[i]) few.push_back(points[i]);
  CHECK(few.size() >= 4 && few.size() <= 20);
  CHECK_NEAR(least_gap(few), least_gap(points), 2e-6);
}

// A body whose centre has got below the surface is pushed out along the normal of the closest face, by its
// whole depth; one-sided: a body below an open floor, out of its own reach, feels nothing.
TEST(deep_bodies_are_pushed_out) {
  const Shape floor = floor_mesh(16, 0.25, 0.2, 13, [](double, double) { return 0.0; }).mesh();
  const Shape field = make_height_field(std::vector<double>(17 * 17, 0.0), 17, 17, 4, 4);
  small::Random random(14);
  for (const Shape& shape : all_shapes())
    for (int pose = 0; pose < 50; ++pose) {
      const Quat rotation = random_rotation(random);
      const double low = lowest_point(shape, rotation);
      const Vec3 at{random.uniform(-1, 1), random.uniform(-1, 1), 0};
      for (const Shape& surface : {floor, field}) {
        const double depth = -0.8 * low;
        const auto points = contacts(shape, {at + Vec3{0, 0, -depth}, rotation}, surface, 0.01);
        CHECK_NEAR(least_gap(points), low - depth, 1e-9);
        for (const ContactPoint& p : points) CHECK_NEAR(norm(p.normal - Vec3{0, 0, 1}), 0, 1e-9);
        CHECK(contacts(shape, {at + Vec3{0, 0, -5}, rotation}, surface, 0.01).empty());
      }
      // Wholly under a height field, by less than its own size.
      const auto sunk = contacts(shape, {at + Vec3{0, 0, 1.3 * low}, rotation}, field, 0.01);
      CHECK_NEAR(least_gap(sunk), 2.3 * low, 1e-9);
    }
}

// Height fields against the mesh of the same triangles, diagonals as documented: the same points, deep ones
// on this rough ground included. The search for the distance of ellipsoids and of rims of cylinders ends
// where it makes no more progress, with a direction good to some 1e-6: of 18600 poses of 31 other seeds 662
// differed by more than 1e-8 m, all of these two shapes, by 2.1e-6 m at most.
TEST(height_field_is_its_mesh) {
  small::Random random(15);
  const int rows = 9, columns = 13;
  std::vector<double> heights;
  for (int k = 0; k < rows * columns; ++k) heights.push_back(0.1 * random.uniform(-1, 1));
  const Shape field = make_height_field(heights, rows, columns, 3, 2);
  Triangles t;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      t.vertices.push_back({3 * (c / 12.0 - 0.5), 2 * (r / 8.0 - 0.5), heights[r * columns + c]});
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c + 1 < columns; ++c) {
      const int a = r * columns + c, d = a + columns + 1;
      t.triangles.push_back({a, a + 1, d});
      t.triangles.push_back({a, d, a + columns});
    }
  const Shape mesh = t.mesh();
  const Transform tilted{{1, 2, 3}, random_rotation(random)};
  for (const Shape& shape : all_shapes())
    for (int pose = 0; pose < 100; ++pose) {
      const Quat rotation = random_rotation(random);
      const Vec3 at{random.uniform(-1.6, 1.6), random.uniform(-1.1, 1.1), random.uniform(0.1, 0.45)};
      const auto expected = contacts(shape, tilted * Transform{at, rotation}, mesh, 0.02, tilted);
      const auto found = contacts(shape, tilted * Transform{at, rotation}, field, 0.02, tilted);
      const bool curved = std::holds_alternative<Ellipsoid>(shape) || std::holds_alternative<Cylinder>(shape);
      const double tolerance = curved ? 1e-5 : 1e-8;
      CHECK(found.size() == expected.size());
      CHECK_NEAR(least_gap(found), least_gap(expected), tolerance);
      for (const ContactPoint& p : expected) CHECK(has_point(found, p.point, p.gap, tolerance));
    }
}
