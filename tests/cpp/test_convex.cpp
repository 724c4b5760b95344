#include "amontons/collision/narrow/extent.hpp"
#include "check.hpp"
#include "collision/narrow/feature.hpp"
#include "collision/narrow/separation.hpp"
#include "collision_scenes.hpp"

// Distance and penetration of convex bodies, certified without an oracle: a normal n separates the
// bodies by s(n) = min_a <n, a> - max_b <n, b>, which the support functions give; the distance is
// the largest s over all n.
using namespace scenes;
using namespace amontons::collision;

namespace {

struct Named {
  const char* name;
  Shape shape;
  bool round;  // EPA approaches these within 1e-8 of their size, and meets the others
};

std::vector<Named> bodies() {
  return {{"box", Box{{0.5, 0.3, 0.2}}, false},
          {"plank", Box{{2, 0.05, 0.01}}, false},
          {"capsule", Capsule{0.1, 0.4}, false},
          {"cylinder", Cylinder{0.4, 0.3}, true},
          {"coin", Cylinder{0.4, 0.02}, true},
          {"ellipsoid", Ellipsoid{{0.5, 0.3, 0.2}}, true},
          {"hexagon", prism(6, 0.4, 0.3), false},
          {"drum", prism(64, 0.4, 0.3), false},
          {"hull box", box_hull({0.5, 0.3, 0.2}), false},
          {"sphere", Sphere{0.3}, false}};
}

// Every third pose is degenerate: axes and positions on a lattice, parallel edges, coincident centres.
void random_pose(Random& random, int k, Transform& a, Transform& b) {
  const auto lattice = [&] {
    Quat q;
    for (int i = 0; i < 3; ++i) {
      Vec3 axis;
      axis[i] = 1;
      q = q * turn(axis, std::floor(4 * std::abs(random())) * 3.141592653589793 / (k % 2 ? 2 : 4));
    }
    return q;
  };
  const bool degenerate = k % 3 == 0;
  a.rotation = degenerate ? lattice() : random.rotation();
  b.rotation = degenerate ? lattice() : random.rotation();
  a.position = random.vector();
  if (degenerate)
    for (int i = 0; i < 3; ++i) a.position[i] = 0.1 * std::round(8 * a.position[i]);
  b.position = {};
}

double separated_by(const Convex& a, const Convex& b, const Vec3& n) {
  return dot(n, support(a, -n) - support(b, n)) - a.radius - b.radius;
}

// The best of a fixed fan of directions, climbed to the top nearby.
double best_separation(const Convex& a, const Convex& b, const std::vector<Vec3>& fan, Random& random) {
  double best = -INFINITY;
  Vec3 n;
  for (const Vec3& d : fan)
    if (const double s = separated_by(a, b, d); s > best) {
      best = s;
      n = d;
    }
  for (double step = 0.1; step > 1e-6;) {
    const Vec3 d = normalised(n + step * random.vector());
    if (const double s = separated_by(a, b, d); s > best) {
      best = s;
      n = d;
    } else {
      step *= 0.9;
    }
  }
  return best;
}

}  // namespace

// Fails if GJK or EPA ends away from the optimum, loses a pair to its limit, or gives points that are not as
// far apart as it says.
TEST(distance_and_penetration_are_certified_by_support_functions) {
  Random random;
  std::vector<Vec3> fan;
  for (int i = 0; i < 100; ++i) fan.push_back(normalised(random.vector()));
  const std::vector<Named> list = bodies();
  for (std::size_t i = 0; i < list.size(); ++i)
    for (std::size_t j = i; j < list.size(); ++j)
      for (int k = 0; k < 300; ++k) {
        Transform frame_a, frame_b;
        random_pose(random, k, frame_a, frame_b);
        const Convex a = make_convex(list[i].shape, frame_a, {}), b = make_convex(list[j].shape, frame_b, {});
        const Separation s = separation(a, b, 1e3);
        CHECK(s.within);
        // Giving up early at a limit must not lose a pair.
        CHECK(separation(a, b, s.distance + 1e-7).within);
        CHECK(!separation(a, b, s.distance - 1e-6).within);
        CHECK_NEAR(norm(s.normal), 1, 1e-14);
        // The normal realises the distance: separated bodies are at least that far apart, overlapping ones
        // come free when moved by it.
        CHECK_NEAR(separated_by(a, b, s.normal), s.distance, 1e-7);
        // No two points are closer than the distance says, and no direction out is shorter. (Rings of equally
        // short directions exhaust EPA's 132 points at 1e-3 of a radius.)
        if (s.distance > 0)
          CHECK(norm(s.on_a - s.on_b - s.distance * s.normal) <= 1e-6);
        else
          CHECK(best_separation(a, b, fan, random) <= s.distance + 1e-3);
      }
}

TEST(penetration_of_polyhedra_is_exact) {
  // A box k deep in a slab's top comes out along the slab's normal, whatever its turn about it. Fails if EPA
  // stops early, or at an edge of the difference instead of the face.
  for (double depth : {1e-12, 1e-6, 1e-3, 0.1}) {
    const Shape hull = box_hull({0.5, 0.3, 0.2});
    const Convex slab = make_convex(Box{{4, 4, 1}}, {}, {});
    const Convex box = make_convex(hull, {{0.3, 0.1, 1.2 - depth}, turn({0, 0, 1}, 0.4)}, {});
    const Separation s = separation(box, slab, 0);
    CHECK(s.within);
    CHECK_NEAR(s.distance, -depth, 1e-14);
    CHECK_NEAR(norm(s.normal - Vec3{0, 0, 1}), 0, 1e-12);
    CHECK_NEAR(norm(s.on_a - s.on_b - s.distance * s.normal), 0, 1e-12);
  }
}

TEST(flat_and_point_like_differences_part_across_their_plane) {
  // A segment through a triangle in its own plane: the difference is flat, which no polytope can grow in.
  const Convex triangle = make_triangle({-1, -1, 0}, {1, -1, 0}, {0, 1, 0});
  const Convex capsule = make_convex(Capsule{0.1, 0.5}, {{0, 0, 0}, turn({0, 1, 0}, 1.5707963267948966)}, {});
  const Separation s = separation(capsule, triangle, 0.1);
  CHECK(s.within);
  CHECK_NEAR(s.distance, -0.1, 1e-14);
  CHECK_NEAR(std::abs(s.normal.z), 1, 1e-14);
  // Two spheres on one centre: any direction will do, but it must be one.
  const Convex sphere = make_convex(Sphere{0.2}, {}, {});
  const Separation t = separation(sphere, sphere, 0);
  CHECK_NEAR(t.distance, -0.4, 1e-15);
  CHECK_NEAR(norm(t.normal), 1, 1e-15);
}

// Fails if a face is taken for an edge or the other way round at the thresholds of feature.cpp, or if the
// corners of a face run the wrong way.
TEST(features_are_what_supports_the_body) {
  const Convex box = make_convex(Box{{1, 2, 3}}, {}, {});
  Feature f;
  const auto along = [&](const Convex& body, Vec3 d) {
    supporting_feature(body, normalised(d), nullptr, nullptr, f);
    return f.count;
  };
  CHECK(along(box, {0.1, 0.1, 1}) == 4);
  for (int k = 0; k < 4; ++k) CHECK(f.points[k].z == 3);
  CHECK(along(box, {1, 1, 0.1}) == 2);
  CHECK(along(box, {1, 1, 1}) == 1);
  const Convex drum = make_convex(Cylinder{0.5, 1}, {}, {});
  CHECK(along(drum, {0, 0, -1}) == 12);
  CHECK(along(drum, {0.05, 0, 1}) == 13);  // with the rim's lowest point
  CHECK(along(drum, {1, 0, 0.1}) == 2);
  CHECK(along(drum, {1, 0, 1}) == 1);
  // Faces run counter-clockwise seen from outside: clipping relies on it.
  const Shape pentagon = prism(5, 1, 1);
  for (const Convex& body : {box, drum, make_convex(pentagon, {}, {})})
    for (Vec3 d : {Vec3{0, 0, 1}, Vec3{0, 0, -1}}) {
      CHECK(along(body, d) > 2);
      CHECK(dot(cross(f.points[1] - f.points[0], f.points[2] - f.points[1]), d) > 0);
      CHECK(f.normal == d);
    }
}

// Against closed forms of the support functions: fails if a radius, the frame or the point that it counts
// from is left out.
TEST(extent_along_a_direction) {
  const Vec3 d = normalised(Vec3{1, 2, 2}), centre{3, -2, 1}, from{1, 1, 1};
  const Quat q = turn({3, 1, 2}, 0.7);
  const Vec3 own = rotate(conjugate(q), d);
  const double offset = dot(d, centre - from);
  const auto extent = [&](const Shape& shape) { return extent_along(shape, {centre, q}, d, from) - offset; };
  CHECK_NEAR(extent(Sphere{0.5}), 0.5, 1e-15);
  CHECK_NEAR(extent(Capsule{0.5, 2}), 0.5 + 2 * std::abs(own.z), 1e-15);
  const double box = std::abs(own.x) + 2 * std::abs(own.y) + 3 * std::abs(own.z);
  CHECK_NEAR(extent(Box{{1, 2, 3}}), box, 1e-14);
  CHECK_NEAR(extent(box_hull({1, 2, 3})), box, 1e-14);
  CHECK_NEAR(extent(Cylinder{0.5, 2}), 0.5 * std::hypot(own.x, own.y) + 2 * std::abs(own.z), 1e-14);
  CHECK_NEAR(extent(Ellipsoid{{1, 2, 3}}), norm(Vec3{own.x, 2 * own.y, 3 * own.z}), 1e-14);
}

// In turned frames, just within the distance and just beyond it. Fails if a surface of triangles is taken for
// its back side alone, a convex shape or a plane for its surface without the inside, or a frame is forgotten.
TEST(points_near_shapes) {
  const Quat q = turn({3, 1, 2}, 0.7);
  const Transform frame{{1, -2, 3}, q};
  const Shape field = make_height_field(std::vector<double>(9, 0.5), 3, 3, 2, 2);
  const std::vector<Vec3> corners{{-1, -1, 0.5}, {1, -1, 0.5}, {1, 1, 0.5}, {-1, 1, 0.5}};
  const Shape mesh = make_mesh(corners, std::vector<std::array<std::int32_t, 3>>{{0, 1, 2}, {0, 2, 3}});
  const double distance = 1e-3;
  for (const Shape& shape : std::vector<Shape>{Box{{1, 1, 0.5}}, box_hull({1, 1, 0.5}), field, mesh}) {
    for (double factor : {0.99, 1.01}) {
      const double d = factor * distance;
      for (const Vec3& p : {Vec3{0.3, 0.2, 0.5 + d}, Vec3{1 + d, 0.2, 0.5}, Vec3{0.3, -1 - d, 0.5}})
        CHECK(is_near(shape, frame, frame(p), distance) == (factor < 1));
    }
    const bool solid = std::holds_alternative<Box>(shape) || std::holds_alternative<Hull>(shape);
    CHECK(is_near(shape, frame, frame({0.1, 0.1, 0.2}), distance) == solid);
  }
  CHECK(is_near(Plane{}, frame, frame({9, 9, -5}), distance));
  CHECK(!is_near(Plane{}, frame, frame({9, 9, 1.01e-3}), distance));
  const Vec3 up = rotate(q, {0, 0, 1});
  for (const Shape& shape : {field, mesh}) {
    CHECK(has_triangle(shape, frame, up, frame({1, 0.5, 0.5}), distance));
    CHECK(!has_triangle(shape, frame, -up, frame({1, 0.5, 0.5}), distance));
    CHECK(!has_triangle(shape, frame, rotate(q, {2e-4, 0, 1}), frame({1, 0.5, 0.5}), distance));
    CHECK(!has_triangle(shape, frame, up, frame({1.01, 0.5, 0.5}), distance));
  }
  CHECK(has_face(Box{{1, 1, 0.5}}, frame, up) && has_face(box_hull({1, 1, 0.5}), frame, -up));
  CHECK(!has_face(Box{{1, 1, 0.5}}, frame, rotate(q, normalised(Vec3{1, 1, 1}))));
  CHECK(!has_face(Sphere{1}, frame, up) && !has_face(Capsule{1, 1}, frame, up));
}
