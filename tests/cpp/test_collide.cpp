#include <limits>

#include "check.hpp"
#include "collision_scenes.hpp"

// The narrow phase against closed forms, pair by pair.
using namespace scenes;

namespace {

constexpr double pi = 3.141592653589793;
const Quat straight;
const Quat lying = turn({1, 0, 0}, pi / 2);  // z turned to -y: along y

// One contact at `point` with the given normal and gap.
void check_one(const std::vector<ContactPoint>& found, const Vec3& point, const Vec3& normal, double gap,
               double tolerance) {
  CHECK(found.size() == 1);
  if (found.size() != 1) return;
  CHECK_NEAR(norm(found[0].point - point), 0, tolerance);
  CHECK_NEAR(norm(found[0].normal - normal), 0, tolerance);
  CHECK_NEAR(found[0].gap, gap, tolerance);
}

// Exactly these points, in any order, all with one normal and gap.
void check_all(const std::vector<ContactPoint>& found, std::vector<Vec3> expected, const Vec3& normal,
               double gap, double tolerance) {
  CHECK(found.size() == expected.size());
  for (const ContactPoint& c : found) {
    CHECK_NEAR(norm(c.normal - normal), 0, tolerance);
    CHECK_NEAR(c.gap, gap, tolerance);
    double nearest = INFINITY;
    for (const Vec3& p : expected) nearest = std::min(nearest, norm(c.point - p));
    CHECK_NEAR(nearest, 0, tolerance);
  }
  for (const Vec3& p : expected) {
    double nearest = INFINITY;
    for (const ContactPoint& c : found) nearest = std::min(nearest, norm(c.point - p));
    CHECK_NEAR(nearest, 0, tolerance);
  }
}

}  // namespace

// Fails if radii enter the gap or the point wrongly, or if the normal of concentric spheres is 0 / 0.
TEST(spheres) {
  const Shape a = Sphere{1}, b = Sphere{2};
  check_one(contacts(a, {{0, 3.5, 0}, straight}, b, {}, 0.6), {0, 2.25, 0}, {0, 1, 0}, 0.5, 1e-15);
  check_one(contacts(a, {{0, 2.5, 0}, straight}, b, {}, 0), {0, 1.75, 0}, {0, 1, 0}, -0.5, 1e-15);
  CHECK(contacts(a, {{0, 3.5, 0}, straight}, b, {}, 0.4).empty());
  // A turn of a ball changes no bit: poses later in a step are found for their centres alone.
  const Vec3 beside{0.3, 2.1, -1.7};
  const auto still = contacts(a, {beside, {}}, b, {}, 1),
             turned = contacts(a, {beside, lying}, b, {{}, turn({1, 2, 3}, 0.7)}, 1);
  CHECK(still.size() == 1 && turned.size() == 1 && still[0].point == turned[0].point &&
        still[0].normal == turned[0].normal && still[0].gap == turned[0].gap);
  // On one centre no direction is right; the contact must still be finite, and push.
  const auto same = contacts(a, {}, b, {}, 0);
  CHECK(same.size() == 1 && is_finite(same[0].normal) && same[0].gap == -3);
}

// Beside the segment, beyond its end, and a centre on the axis, where the normal has to be chosen: fails if
// the segment is not cut off at its ends, or if the axis gives a normal along itself.
TEST(sphere_and_capsule) {
  const Shape sphere = Sphere{0.5}, capsule = Capsule{0.25, 1};
  check_one(contacts(sphere, {{1, 0, 0.5}, straight}, capsule, {}, 1), {0.375, 0, 0.5}, {1, 0, 0}, 0.25,
            1e-15);
  check_one(contacts(sphere, {{0, 0, 2}, straight}, capsule, {}, 1), {0, 0, 1.375}, {0, 0, 1}, 0.25, 1e-15);
  const auto inside = contacts(sphere, {{0, 0, 0.5}, straight}, capsule, {}, 0);
  CHECK(inside.size() == 1 && inside[0].gap == -0.75 && inside[0].normal.z == 0);
}

// Face, corner and inside: fails if the regions of the box are mixed up, or if a centre inside leaves by
// another face than the nearest.
TEST(sphere_and_box) {
  const Shape sphere = Sphere{0.5}, box = Box{{1, 2, 3}};
  const double s = 1 / std::sqrt(3.0);
  check_one(contacts(sphere, {{1.6, 1, 1}, straight}, box, {}, 1), {1.05, 1, 1}, {1, 0, 0}, 0.1, 1e-15);
  check_one(contacts(sphere, {{2, 3, 4}, straight}, box, {}, 2),
            Vec3{1, 2, 3} + 0.5 * (std::sqrt(3.0) - 0.5) * Vec3{s, s, s}, {s, s, s}, std::sqrt(3.0) - 0.5,
            1e-14);
  // A centre inside leaves by the nearest face.
  check_one(contacts(sphere, {{0.9, 0, 0}, straight}, box, {}, 0), {0.7, 0, 0}, {1, 0, 0}, -0.6, 1e-15);
  check_one(contacts(sphere, {{0, 0, -2.9}, straight}, box, {}, 0), {0, 0, -2.7}, {0, 0, -1}, -0.6, 1e-15);
}

// Side, cap, rim and inside, as above.
TEST(sphere_and_cylinder) {
  const Shape sphere = Sphere{0.5}, cylinder = Cylinder{1, 2};
  check_one(contacts(sphere, {{0, 1.75, 1}, straight}, cylinder, {}, 1), {0, 1.125, 1}, {0, 1, 0}, 0.25,
            1e-15);
  check_one(contacts(sphere, {{0.5, 0, 2.75}, straight}, cylinder, {}, 1), {0.5, 0, 2.125}, {0, 0, 1}, 0.25,
            1e-15);
  // Beyond the rim: the 3-4-5 triangle from the rim's point (1, 0, 2).
  check_one(contacts(sphere, {{1.6, 0, 2.8}, straight}, cylinder, {}, 1), {1.15, 0, 2.2}, {0.6, 0, 0.8}, 0.5,
            1e-15);
  check_one(contacts(sphere, {{0.9, 0, 0}, straight}, cylinder, {}, 0), {0.7, 0, 0}, {1, 0, 0}, -0.6, 1e-15);
  check_one(contacts(sphere, {{0, 0, 1.9}, straight}, cylinder, {}, 0), {0, 0, 1.7}, {0, 0, 1}, -0.6, 1e-15);
}

TEST(sphere_and_ellipsoid) {
  // From a point of the surface along its normal: the point is the foot, however flat the ellipsoid, as long
  // as the way is shorter than the least radius of curvature (inside: r_min^2 / r_max). Fails if the root
  // finding stops at the wrong root or early.
  Random random;
  for (const Vec3& r :
       {Vec3{1, 1, 1}, Vec3{3, 2, 1}, Vec3{0.01, 1, 2}, Vec3{1, 1, 0.05}, Vec3{2, 0.1, 0.1}}) {
    const Shape ellipsoid = Ellipsoid{r}, sphere = Sphere{1e-3};
    const double least = std::min({r.x, r.y, r.z}), most = std::max({r.x, r.y, r.z});
    for (int k = 0; k < 500; ++k) {
      Vec3 u = random.vector();
      if (k % 4 == 0) u[k % 3] = 0;  // on the symmetry planes
      u = normalised(u);
      const Vec3 p{r.x * u.x, r.y * u.y, r.z * u.z}, n = normalised(Vec3{u.x / r.x, u.y / r.y, u.z / r.z});
      for (double height : {2.0, 1e-3, 0.0, -0.5 * least * least / most}) {
        const auto found = contacts(sphere, {p + height * n, straight}, ellipsoid, {}, 3);
        CHECK(found.size() == 1);
        // The normal's error is the foot's, 1e-16 of the size, over the least radius of curvature.
        const double bend = most / (least * least / most);
        CHECK_NEAR(found[0].gap, height - 1e-3, 1e-14 * most);
        CHECK_NEAR(norm(found[0].normal - n), 0, 1e-14 * bend);
      }
    }
    // The centre leaves along the shortest axis.
    CHECK_NEAR(contacts(sphere, {}, ellipsoid, {}, 0)[0].gap, -least - 1e-3, 1e-14);
  }
}

// The general way where the exact one is not open to hulls: face, inside and edge. Fails if the radius is
// lost between core and surface.
TEST(sphere_and_hull) {
  const Shape sphere = Sphere{0.5}, hull = box_hull({1, 2, 3});
  check_one(contacts(sphere, {{1.6, 1, 1}, straight}, hull, {}, 1), {1.05, 1, 1}, {1, 0, 0}, 0.1, 1e-14);
  check_one(contacts(sphere, {{0.9, 0, 0}, straight}, hull, {}, 0), {0.7, 0, 0}, {1, 0, 0}, -0.6, 1e-14);
  check_one(contacts(sphere, {{1.3, 2.4, 0}, straight}, hull, {}, 0.1), {1, 2, 0}, {0.6, 0.8, 0}, 0, 1e-14);
}

// Fails if the parameters of the nearest points are not cut off together, if one end of a line of
// contact is lost, if crossing axes (distance 0) have no normal, or if the ends of nearly parallel
// capsules hide the deeper middle.
TEST(capsules) {
  const Shape capsule = Capsule{0.1, 0.5};
  // Side by side: both ends of what they share.
  check_all(contacts(capsule, {{0.25, 0, 0.3}, straight}, capsule, {}, 0.1),
            {{0.125, 0, -0.2}, {0.125, 0, 0.5}}, {1, 0, 0}, 0.05, 1e-15);
  // Crossing, end to end, and end on side.
  check_one(contacts(capsule, {{0, 0, 0.2}, lying}, capsule, {{}, turn({0, 1, 0}, pi / 2)}, 0.1), {0, 0, 0.1},
            {0, 0, 1}, 0, 1e-15);
  check_one(contacts(capsule, {{0, 0, 1.3}, straight}, capsule, {}, 0.2), {0, 0, 0.65}, {0, 0, 1}, 0.1,
            1e-15);
  check_one(contacts(capsule, {{0.7, 0, 0}, turn({0, 1, 0}, pi / 2)}, capsule, {}, 0.1), {0.1, 0, 0},
            {1, 0, 0}, 0, 1e-15);
  // Through each other: perpendicular to both.
  const auto crossed = contacts(capsule, {{}, lying}, capsule, {}, 0);
  CHECK(crossed.size() == 1);
  CHECK_NEAR(std::abs(crossed[0].normal.x), 1, 1e-12);
  CHECK_NEAR(crossed[0].gap, -0.2, 1e-15);
  // Nearly parallel, crossing in the middle at 0.05 rad: the middle is the deepest, and must be there.
  const auto skew = contacts(capsule, {{0.2, 0, 0}, turn({1, 0, 0}, 0.05)}, capsule, {}, 0.1);
  CHECK_NEAR(least_gap(skew), 0, 1e-15);
  CHECK(skew.size() == 3);
}

// Fails if a capsule on a face touches at one end only, beyond the border of the face, or
// with the depth of its core.
TEST(capsule_on_flat_faces) {
  const Shape capsule = Capsule{0.1, 0.5};
  const std::vector<Vec3> ends{{0, -0.5, 0.21}, {0, 0.5, 0.21}};
  for (const Shape& below : {Shape{Box{{1, 1, 0.2}}}, Shape{box_hull({1, 1, 0.2})}, Shape{Cylinder{1, 0.2}}})
    // On the cylinder the ends lie within the 12-gon of the cap: cos(15 deg) = 0.966.
    check_all(contacts(capsule, {{0, 0, 0.32}, lying}, below, {}, 0.05), ends, {0, 0, 1}, 0.02, 1e-14);
  // Over the border the face ends the line.
  check_all(contacts(capsule, {{0, 0.8, 0.3}, lying}, Box{{1, 1, 0.2}}, {}, 0.05),
            {{0, 0.3, 0.2}, {0, 1, 0.2}}, {0, 0, 1}, 0, 1e-14);
  // Along an edge, at 45 degrees to both faces.
  const double s = std::sqrt(0.5);
  check_all(contacts(capsule, {{1 + 0.1 * s, 0, 0.2 + 0.1 * s}, lying}, Box{{1, 1, 0.2}}, {}, 0.05),
            {{1, -0.5, 0.2}, {1, 0.5, 0.2}}, {s, 0, s}, 0, 1e-14);
  // Upright: one point.
  check_one(contacts(capsule, {{0, 0, 0.8}, straight}, Box{{1, 1, 0.2}}, {}, 0.05), {0, 0, 0.2}, {0, 0, 1}, 0,
            1e-14);
  // Its axis inside the box: the depth counts from the axis.
  check_all(contacts(capsule, {{0, 0, 0.15}, lying}, Box{{1, 1, 0.2}}, {}, 0.05),
            {{0, -0.5, 0.125}, {0, 0.5, 0.125}}, {0, 0, 1}, -0.15, 1e-12);
}

// Fails if clipping loses or repeats a corner, leaves one that is off by rounding, or
// merges those of an octagon.
TEST(boxes_face_on_face_touch_at_the_corners_of_the_overlap) {
  // Bricks in running bond: corners exactly there, as the wall must stay symmetric.
  const Shape brick = Box{{0.1, 0.05, 0.03}};
  check_all(contacts(brick, {{0.1, 0, 0.06}, straight}, brick, {}, 0.01),
            {{0, 0.05, 0.03}, {0.1, 0.05, 0.03}, {0, -0.05, 0.03}, {0.1, -0.05, 0.03}}, {0, 0, 1}, 0, 1e-16);
  check_all(contacts(brick, {{0.2, 0, 0}, straight}, brick, {}, 0.01),
            {{0.1, 0.05, 0.03}, {0.1, -0.05, 0.03}, {0.1, 0.05, -0.03}, {0.1, -0.05, -0.03}}, {1, 0, 0}, 0,
            1e-16);
  // Turned by 45 degrees: two squares of side 2 share a regular octagon of inradius 1.
  const double o = std::sqrt(2.0) - 1;
  std::vector<Vec3> octagon;
  for (double x : {-1.0, 1.0})
    for (double y : {-o, o}) {
      octagon.push_back({x, y, 1});
      octagon.push_back({y, x, 1});
    }
  check_all(contacts(Box{{1, 1, 1}}, {{0, 0, 2}, turn({0, 0, 1}, pi / 4)}, Box{{1, 1, 1}}, {}, 0.1), octagon,
            {0, 0, 1}, 0, 1e-15);
  // In a corner of a large slab.
  check_all(contacts(brick, {{5, 5, 1.03}, straight}, Box{{5, 5, 1}}, {}, 0.01),
            {{4.9, 4.95, 1}, {5, 4.95, 1}, {4.9, 5, 1}, {5, 5, 1}}, {0, 0, 1}, 0, 1e-15);
}

// Fails if a sliver of overlap is taken for an area, if separating axes stand for the distance between two
// edges or corners (they see less), or if the margin is measured along the axes.
TEST(boxes_that_share_an_edge_or_a_corner_only_give_no_area) {
  // Diagonal neighbours of a wall: at most the ends of the common edge, with no
  // garbage for a gap or a normal.
  const Shape brick = Box{{0.1, 0.05, 0.03}};
  for (double gap : {-1e-5, -1e-9, 0.0, 1e-9, 1e-5, 1e-3}) {
    const auto edge = contacts(brick, {{0.2 + gap, 0, 0.06 + gap}, straight}, brick, {}, 0.01);
    CHECK(edge.size() <= 2 && !edge.empty());
    for (const ContactPoint& c : edge) {
      CHECK_NEAR(c.gap, gap > 0 ? std::sqrt(2.0) * gap : gap, 1e-15);
      CHECK_NEAR(std::abs(c.point.y), 0.05, 1e-9);
      CHECK_NEAR(c.normal.y, 0, 1e-9);
      CHECK(c.normal.x >= 0 && c.normal.z >= 0);
    }
    const auto corner = contacts(brick, {{0.2 + gap, 0.1 + gap, 0.06 + gap}, straight}, brick, {}, 0.01);
    CHECK(corner.size() == 1);
    CHECK_NEAR(corner[0].gap, gap > 0 ? std::sqrt(3.0) * gap : gap, 1e-15);
  }
  const double s = std::sqrt(0.5);
  check_all(contacts(brick, {{0.201, 0, 0.061}, straight}, brick, {}, 0.01),
            {{0.1005, 0.05, 0.0305}, {0.1005, -0.05, 0.0305}}, {s, 0, s}, 1e-3 / s, 1e-14);
  // Diagonal farther than the margin, nearer than it along each axis.
  CHECK(contacts(brick, {{0.208, 0, 0.068}, straight}, brick, {}, 0.01).empty());
}

// Fails if an edge on a face gives one point, if crossing edges touch at an end instead of where they cross,
// or if a box between two flat views takes the normal of a face that does not touch.
TEST(boxes_on_edges_and_corners) {
  const Shape cube = Box{{1, 1, 1}}, slab = Box{{3, 3, 1}};
  const Quat on_edge = turn({1, 0, 0}, pi / 4), on_corner = turn({1, -1, 0}, std::acos(1 / std::sqrt(3.0)));
  check_all(contacts(cube, {{0.1, 0.2, 1.01 + std::sqrt(2.0)}, on_edge}, slab, {}, 0.1),
            {{1.1, 0.2, 1.005}, {-0.9, 0.2, 1.005}}, {0, 0, 1}, 0.01, 1e-14);
  check_one(contacts(cube, {{0.1, 0.2, 1.01 + std::sqrt(3.0)}, on_corner}, slab, {}, 0.1), {0.1, 0.2, 1.005},
            {0, 0, 1}, 0.01, 1e-14);
  // Two edges crossing at a right angle, apart and overlapping.
  const Quat across = turn({0, 0, 1}, pi / 2) * on_edge;
  for (double gap : {0.01, 0.0, -0.1})
    check_one(contacts(cube, {{0, 0, 2 * std::sqrt(2.0) + gap}, across}, cube, {{}, on_edge}, 0.1),
              {0, 0, std::sqrt(2.0) + gap / 2}, {0, 0, 1}, gap, 1e-14);
  // Corner against corner along the diagonal: no separating axis sees this distance.
  const double s = 1 / std::sqrt(3.0);
  check_one(contacts(cube, {{2.01, 2.01, 2.01}, straight}, cube, {}, 0.1), {1.005, 1.005, 1.005}, {s, s, s},
            0.01 / s, 1e-14);
}

// Fails if a deep overlap takes another axis than that of the least separation, or none for equal centres.
TEST(deep_boxes_leave_by_the_shortest_way) {
  const Shape brick = Box{{0.1, 0.05, 0.03}};
  check_all(contacts(brick, {{0.02, 0.01, 0.02}, straight}, brick, {}, 0),
            {{0.1, 0.05, 0.01}, {0.1, -0.04, 0.01}, {-0.08, 0.05, 0.01}, {-0.08, -0.04, 0.01}}, {0, 0, 1},
            -0.04, 1e-15);
  const auto same = contacts(brick, {}, brick, {}, 0);
  CHECK(same.size() == 4);
  for (const ContactPoint& c : same) {
    CHECK_NEAR(std::abs(c.normal.z), 1, 1e-15);
    CHECK_NEAR(c.gap, -0.06, 1e-15);
  }
}

// Fails if polygons of two caps are turned against each other, if a generator gives one point, if EPA's
// triangles (1e-8 of the size, a normal to its root) are not sharpened, or if a tilted rim is thinned out.
TEST(cylinders) {
  const Shape drum = Cylinder{0.5, 1};
  const Quat flat = straight;
  // Coaxial: the caps' 12-gons coincide.
  const auto stack = contacts(drum, {{0, 0, 2.02}, flat}, drum, {}, 0.1);
  CHECK(stack.size() == 12);
  for (const ContactPoint& c : stack) {
    CHECK_NEAR(std::hypot(c.point.x, c.point.y), 0.5, 1e-15);
    CHECK_NEAR(c.point.z, 1.01, 1e-15);
    CHECK_NEAR(c.gap, 0.02, 1e-15);
  }
  // Side by side, and crossing.
  for (double gap : {0.02, 0.0, -0.02}) {
    check_all(contacts(drum, {{1 + gap, 0, 0.5}, flat}, drum, {}, 0.1),
              {{0.5 + gap / 2, 0, -0.5}, {0.5 + gap / 2, 0, 1}}, {1, 0, 0}, gap, 1e-7);
    check_one(contacts(drum, {{0, 0, 1 + gap}, lying}, drum, {{}, turn({0, 1, 0}, pi / 2)}, 0.1),
              {0, 0, 0.5 + gap / 2}, {0, 0, 1}, gap, 1e-7);
  }
  // On its side on a box, and on its rim, tilted by the 3-4-5 triangle.
  check_all(contacts(drum, {{0, 0, 1.5}, lying}, Box{{2, 2, 1}}, {}, 0.1), {{0, -1, 1}, {0, 1, 1}}, {0, 0, 1},
            0, 1e-14);
  const double tilt = std::atan2(4, 3);  // height of the rim's lowest point: 1 cos + 0.5 sin
  const auto rim = contacts(drum, {{0, 0, 1 + 0.6 + 0.4}, turn({1, 0, 0}, tilt)}, Box{{2, 2, 1}}, {}, 0.1);
  CHECK(rim.size() == 1);
  CHECK_NEAR(rim[0].gap, 0, 1e-14);
  CHECK_NEAR(norm(rim[0].normal - Vec3{0, 0, 1}), 0, 1e-14);
  // The rim's point at (0, -0.5, -1) of the drum, turned: y = -0.5 cos + 1 sin.
  CHECK_NEAR(norm(rim[0].point - Vec3{0, -0.3 + 0.8, 1}), 0, 1e-14);
}

// Fails if the support function is not that of an ellipsoid, if GJK ends early on a smooth surface, or if
// Newton's method does not sharpen what EPA leaves.
TEST(ellipsoids) {
  const Shape egg = Ellipsoid{{0.4, 0.3, 0.2}};
  for (const Shape& below : {Shape{Box{{1, 1, 0.2}}}, Shape{Cylinder{1, 0.2}}, Shape{box_hull({1, 1, 0.2})}})
    for (double gap : {0.02, 0.0, -0.01})
      check_one(contacts(egg, {{0.1, 0.2, 0.4 + gap}, straight}, below, {}, 0.1), {0.1, 0.2, 0.2 + gap / 2},
                {0, 0, 1}, gap, 1e-14);
  // Tilted on a face the lowest point follows from the support function h = |R n|.
  const Quat q = turn({1, 2, 3}, 0.8);
  const Vec3 d = rotate(conjugate(q), {0, 0, 1});
  const double h = norm(Vec3{0.4 * d.x, 0.3 * d.y, 0.2 * d.z});
  const auto tilted = contacts(egg, {{0, 0, 0.2 + h}, q}, Box{{1, 1, 0.2}}, {}, 0.1);
  CHECK(tilted.size() == 1);
  CHECK_NEAR(tilted[0].gap, 0, 1e-14);
  // Pole on pole. GJK ends when its bounds of the distance agree to 1e-13; the normal is good to the root of
  // that. Overlapping, Newton's method takes it from EPA's triangles to rounding.
  for (double gap : {0.02, 1e-3, 0.0, -1e-4, -0.02})
    check_one(contacts(egg, {{0, 0, 0.4 + gap}, straight}, egg, {}, 0.1), {0, 0, 0.2 + gap / 2}, {0, 0, 1},
              gap, gap > 0 ? 1e-5 : 1e-9);
}

// Fails if a corner that looks down is left out, if upper corners of thin plates count, if the plane's own
// turn is forgotten, or if a sunk body is lost.
TEST(shapes_on_a_plane) {
  const Transform plane{{0, 0, 1}, turn({1, 0, 0}, pi / 2)};  // its normal is -y
  const Vec3 n{0, -1, 0};
  check_one(contacts(Sphere{0.5}, {{3, -0.6, 4}, straight}, Plane{}, plane, 0.2), {3, -0.05, 4}, n, 0.1,
            1e-15);
  check_one(contacts(Ellipsoid{{1, 2, 3}}, {{3, -2.1, 4}, straight}, Plane{}, plane, 0.2), {3, -0.05, 4}, n,
            0.1, 1e-15);
  check_all(contacts(Capsule{0.5, 1}, {{0, -0.6, 0}, straight}, Plane{}, plane, 0.2),
            {{0, -0.05, -1}, {0, -0.05, 1}}, n, 0.1, 1e-15);
  for (const Shape& box : {Shape{Box{{1, 2, 3}}}, Shape{box_hull({1, 2, 3})}})
    check_all(contacts(box, {{0, -2.1, 0}, straight}, Plane{}, plane, 0.2),
              {{1, -0.05, 3}, {-1, -0.05, 3}, {1, -0.05, -3}, {-1, -0.05, -3}}, n, 0.1, 1e-15);
  // A plate thinner than the margin: the upper corners are hidden by the lower ones.
  CHECK(contacts(Box{{1, 0.01, 1}}, {{0, -0.02, 0}, straight}, Plane{}, plane, 0.2).size() == 4);
  CHECK(contacts(box_hull({1, 0.01, 1}), {{0, -0.02, 0}, straight}, Plane{}, plane, 0.2).size() == 4);
  // On an edge, and sunk with the whole body.
  CHECK(contacts(Box{{1, 1, 1}}, {{0, -std::sqrt(2.0), 0}, turn({1, 0, 0}, pi / 4)}, Plane{}, plane, 0.1)
            .size() == 2);
  CHECK_NEAR(least_gap(contacts(Box{{1, 1, 1}}, {{0, 5, 0}, straight}, Plane{}, plane, 0)), -6, 1e-14);
  // A cylinder upright, lying, and on its rim.
  const Transform ground;
  CHECK(contacts(Cylinder{0.5, 1}, {{0, 0, 1}, straight}, Plane{}, ground, 0.1).size() == 12);
  check_all(contacts(Cylinder{0.5, 1}, {{0, 0, 0.5}, lying}, Plane{}, ground, 0.1), {{0, -1, 0}, {0, 1, 0}},
            {0, 0, 1}, 0, 1e-15);
  const double tilt = std::atan2(4, 3);
  CHECK_NEAR(least_gap(contacts(Cylinder{0.5, 1}, {{0, 0, 1}, turn({1, 0, 0}, tilt)}, Plane{}, ground, 0.1)),
             0, 1e-15);
}

// Along a normal that is given: the part of the upper body over the lower one's face, at its height along
// that normal, and nothing beside it. Fails if the way to the edge, which is shorter, comes in again.
TEST(points_along_a_given_normal) {
  const Vec3 up{0, 0, 1};
  const Shape slab = Box{{1, 1, 0.5}}, box = Box{{0.1, 0.1, 0.1}};
  std::vector<ContactPoint> points;
  const auto along = [&](const Shape& shape, const Vec3& at) -> const std::vector<ContactPoint>& {
    points.clear();
    collide_along(up, {shape, {at, {}}}, {slab, {{0, 0, -0.5}, {}}}, 0.01, points);
    return points;
  };
  CHECK(along(Sphere{0.1}, {1.02, 0, 0.1}).empty());
  check_all(along(Sphere{0.1}, {0.98, 0, 0.105}), {{0.98, 0, 0.0025}}, up, 0.005, 1e-15);
  CHECK(along(box, {1.11, 0, 0.1}).empty());
  // Half over the rim, and a millimetre below the top.
  check_all(along(box, {1, 0, 0.099}),
            {{0.9, 0.1, -5e-4}, {0.9, -0.1, -5e-4}, {1, 0.1, -5e-4}, {1, -0.1, -5e-4}}, up, -1e-3, 1e-15);
}
