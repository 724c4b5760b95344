#include <string>

#include "check.hpp"
#include "collision_scenes.hpp"

// Faces that rest on each other, jittered as in a simulation: the manifold must neither lose a contact, nor
// tilt its normal, nor shrink, at any gap from clear to overlapping. Fails if the normal comes from
// rounding (crossing edges of nearly parallel faces), if a corner is dropped, or if a gap is measured
// elsewhere than at its point.
using namespace scenes;

namespace {

constexpr double margin = 0.03;
constexpr int poses = check::sanitized ? 500 : 20000;

// The upper body's lower face and the lower body's upper face in their own frames,
// counter-clockwise from above.
struct FacePair {
  const char* name;
  Shape upper, lower;
  std::vector<Vec3> upper_face, lower_face;  // two points: a line
  Transform rest;                            // of the upper body at gap 0, the lower one being at the origin
  double inscribed = 1;                      // area that a round cap's polygon keeps
};

std::vector<Vec3> rectangle(double x, double y, double z) {
  return {{x, y, z}, {-x, y, z}, {-x, -y, z}, {x, -y, z}};
}
std::vector<Vec3> circle(int n, double r, double z, double phase = 0) {
  std::vector<Vec3> p;
  for (int k = 0; k < n; ++k) {
    const double a = 6.283185307179586 * k / n + phase;
    p.push_back({r * std::cos(a), r * std::sin(a), z});
  }
  return p;
}

std::vector<FacePair> face_pairs() {
  const Shape box = Box{{0.5, 0.3, 0.2}}, cylinder = Cylinder{0.4, 0.3}, hexagon = prism(6, 0.4, 0.3);
  const Shape slab = Box{{2, 2, 0.2}};
  const auto box_low = rectangle(0.5, 0.3, -0.2), box_top = rectangle(0.5, 0.3, 0.2);
  const auto slab_top = rectangle(2, 2, 0.2), ground = rectangle(9, 9, 0);
  const auto rim = circle(72, 0.4, -0.3);
  // A regular 12-gon covers 12 sin(30 deg) / (2 pi) = 0.955 of its circle.
  const double twelve = 3 / 3.141592653589793;
  const Quat straight, diagonal = turn({0, 0, 1}, 0.7853981633974483),
                       lying = turn({1, 0, 0}, 1.5707963267948966);
  return {
      {"box on box, flush", box, box, box_low, box_top, {{0, 0, 0.4}, straight}},
      {"box on box, turned by 45 degrees", box, box, box_low, box_top, {{0, 0, 0.4}, diagonal}},
      {"box on box, half a length aside", box, box, box_low, box_top, {{0.5, 0, 0.4}, straight}},
      {"box on box, both aside", box, box, box_low, box_top, {{0.31, -0.17, 0.4}, turn({0, 0, 1}, 0.2)}},
      {"box on slab", box, slab, box_low, slab_top, {{0.3, 0.2, 0.4}, straight}},
      {"box on hull", box, hexagon, box_low, circle(6, 0.4, 0.3), {{0, 0, 0.5}, straight}},
      {"box on the same box as hull",
       box,
       box_hull({0.5, 0.3, 0.2}),
       box_low,
       box_top,
       {{0, 0, 0.4}, straight}},
      {"cap on slab", cylinder, slab, rim, slab_top, {{0.1, 0.2, 0.5}, straight}, twelve},
      {"cap on box", cylinder, box, rim, box_top, {{0.1, 0, 0.5}, straight}, twelve},
      {"cap on cap", cylinder, cylinder, rim, circle(72, 0.4, 0.3), {{0, 0, 0.6}, straight}, twelve},
      {"cap on cap, aside",
       cylinder,
       cylinder,
       rim,
       circle(72, 0.4, 0.3),
       {{0.2, 0, 0.6}, diagonal},
       0.99 * twelve},
      {"cap on hull", cylinder, hexagon, rim, circle(6, 0.4, 0.3), {{0, 0, 0.6}, straight}, twelve},
      {"hull on hull", hexagon, hexagon, circle(6, 0.4, -0.3), circle(6, 0.4, 0.3), {{0, 0, 0.6}, straight}},
      {"hull on hull, turned",
       hexagon,
       hexagon,
       circle(6, 0.4, -0.3),
       circle(6, 0.4, 0.3),
       {{0.1, 0, 0.6}, turn({0, 0, 1}, 0.4)}},
      {"hull on slab", hexagon, slab, circle(6, 0.4, -0.3), slab_top, {{0, 0, 0.5}, straight}},
      {"box on plane", box, Plane{}, box_low, ground, {{0, 0, 0.2}, diagonal}},
      {"cap on plane", cylinder, Plane{}, rim, ground, {{0, 0, 0.3}, diagonal}, twelve},
      {"hull on plane", hexagon, Plane{}, circle(6, 0.4, -0.3), ground, {{0, 0, 0.3}, diagonal}},
      {"capsule on box",
       Capsule{0.1, 0.4},
       box,
       {{0, -0.1, 0.4}, {0, -0.1, -0.4}},
       box_top,
       {{0.1, 0, 0.3}, turn({0, 0, 1}, 0.3) * lying}},
      {"capsule beyond a box",
       Capsule{0.1, 0.4},
       box,
       {{0, -0.1, 0.4}, {0, -0.1, -0.4}},
       box_top,
       {{0.2, 0.1, 0.3}, turn({0, 0, 1}, 0.3) * lying}},
      {"capsule on hull",
       Capsule{0.1, 0.4},
       hexagon,
       {{0, -0.1, 0.4}, {0, -0.1, -0.4}},
       circle(6, 0.4, 0.3),
       {{0, 0, 0.4}, lying}},
      {"capsule on plane",
       Capsule{0.1, 0.4},
       Plane{},
       {{0, -0.1, 0.4}, {0, -0.1, -0.4}},
       ground,
       {{0, 0, 0.1}, lying}},
      {"cylinder's side on box",
       Cylinder{0.1, 0.4},
       box,
       {{0, -0.1, 0.4}, {0, -0.1, -0.4}},
       box_top,
       {{0.1, 0, 0.3}, turn({0, 0, 1}, 0.3) * lying}},
      {"cylinder's side on plane",
       Cylinder{0.1, 0.4},
       Plane{},
       {{0, -0.1, 0.4}, {0, -0.1, -0.4}},
       ground,
       {{0, 0, 0.1}, lying}},
  };
}

// Heights of the two faces over a point of the ground, in the world.
struct Face {
  Vec3 point, normal;
  double height(const Vec3& p) const {
    return point.z - (normal.x * (p.x - point.x) + normal.y * (p.y - point.y)) / normal.z;
  }
};
Face face_of(const std::vector<Vec3>& corners, const Transform& frame) {
  const Vec3 a = frame(corners[0]);
  const std::size_t n = corners.size();
  if (n > 2) return {a, normalised(cross(frame(corners[n / 3]) - a, frame(corners[2 * n / 3]) - a))};
  const Vec3 e = frame(corners[1]) - a;  // a line: the plane through it that is level across
  return {a, normalised(cross(e, cross(Vec3{0, 0, 1}, e)))};
}
Polygon shadow(const std::vector<Vec3>& corners, const Transform& frame) {
  Polygon p;
  for (const Vec3& c : corners) {
    const Vec3 q = frame(c);
    p.push_back({q.x, q.y});
  }
  return p;
}
double longest(const Polygon& p) {
  double d = 0;
  for (const auto& a : p)
    for (const auto& b : p) d = std::max(d, std::hypot(a[0] - b[0], a[1] - b[1]));
  return d;
}

void check_pose(const FacePair& pair, const Transform& upper, const Transform& lower, double jitter,
                std::vector<ContactPoint>& points) {
  points.clear();
  collide(pair.upper, upper, pair.lower, lower, margin, points);
  const bool line = pair.upper_face.size() == 2;
  const auto fail = [&](const std::string& what, double value) {
    check::fail(__FILE__, __LINE__,
                std::string(pair.name) + ": " + what + " " + check::number(value) + ", jitter " +
                    check::number(jitter) + ", " + std::to_string(points.size()) + " points");
  };
  const Face up = face_of(pair.upper_face, upper), low = face_of(pair.lower_face, lower);
  Polygon footprint;
  for (const ContactPoint& p : points) {
    footprint.push_back({p.point.x, p.point.y});
    // Either face may give the normal; both are within the jitter of vertical.
    const double tilt = std::hypot(p.normal.x, p.normal.y);
    if (!(tilt <= 4 * jitter + 1e-9) || p.normal.z < 0) return fail("normal tilts by", tilt);
    // Gaps along slightly tilted normals: second order in the jitter, times lengths of order one.
    const double gap = up.height(p.point) - low.height(p.point);
    if (!(std::abs(p.gap - gap) <= 8 * jitter * jitter + 4 * jitter * 0.011 + 1e-12))
      return fail("gap is off by", p.gap - gap);
    const double middle = 0.5 * (up.height(p.point) + low.height(p.point));
    if (!(std::abs(p.point.z - middle) <= 8 * jitter * jitter + 4 * jitter * 0.011 + 1e-12))
      return fail("point is not half-way by", p.point.z - middle);
  }
  Polygon common = intersection(shadow(pair.upper_face, upper), shadow(pair.lower_face, lower));
  // Points closer than 1e-3 of an edge are merged, and a normal tilted by j moves a
  // shadow by j times the gap.
  const double allowed = 4e-3 + 4 * jitter;
  if (line) {
    const double expected = longest(common), found = longest(footprint);
    if (!(std::abs(found - expected) <= allowed * expected + 4 * jitter * 0.011))
      fail("length is off by", found - expected);
    return;
  }
  const double expected = area(common), found = area(hull_of(footprint));
  const double lost = pair.inscribed == 1 ? 0 : 1 - pair.inscribed;
  if (!(found >= (1 - allowed - lost) * expected && found <= (1 + allowed) * expected))
    fail("area is off by the factor", found / expected);
}

}  // namespace

// See above: all pairs of faces, at gaps of either sign, unmoved and jittered by up to a milliradian.
TEST(resting_faces_keep_their_whole_manifold_under_jitter) {
  std::vector<ContactPoint> points;
  for (const FacePair& pair : face_pairs()) {
    Random random;
    for (double gap : {1e-2, 1e-3, 1e-4, 0.0, -1e-4})
      for (double jitter : {0.0, 1e-6, 1e-3})
        for (int k = 0; k < poses / 10; ++k) {
          Transform upper = pair.rest, lower;
          upper.position.z += gap;
          upper.position += jitter * random.vector();
          lower.position += jitter * random.vector();
          upper.rotation = exponential(0.5 * jitter * random.vector()) * upper.rotation;
          if (!std::holds_alternative<Plane>(pair.lower))
            lower.rotation = exponential(0.5 * jitter * random.vector());
          check_pose(pair, upper, lower, jitter, points);
          if (jitter == 0 && k > 0) break;
        }
  }
}

// The table of faces by direction against a pass over all faces, and the walk to low corners against a pass
// over all corners. Fails if a cell of the table lacks a face that is near one of its directions, if the walk
// ends before it has all corners up to the margin, or if either gives them in another order.
TEST(large_hulls_give_what_a_pass_over_all_gives) {
  Random random;
  for (const Hull& shape : {pebble(6, 8, {1, 1, 1}), pebble(24, 40, {1, 0.5, 0.2}),
                            pebble(60, 80, {0.3, 1, 1}), prism(500, 1, 0.4), prism(3, 1, 0.02)}) {
    const ConvexHull& hull = *shape.data;
    for (int k = 0; k < 2000; ++k) {
      Vec3 d = random.vector();
      for (int i = 0; i < 3; ++i)
        if (k % 5 == i) d[i] = 0;  // at the rims of cells
      d = normalised(d);
      std::vector<std::int32_t> near, all;
      for (std::int32_t f : faces_towards(hull, d))
        if (dot(hull.normals[f], d) > face_cosine) near.push_back(f);
      for (std::size_t f = 0; f < hull.faces.size(); ++f)
        if (dot(hull.normals[f], d) > face_cosine) all.push_back(static_cast<std::int32_t>(f));
      CHECK(near == all);
    }
    for (int k = 0; k < 200; ++k) {
      const Transform frame{{0, 0, 0.5 + 0.5 * random()}, random.rotation()};
      const double margin = 0.05;
      std::vector<ContactPoint> expected;
      const Vec3 up = rotate(conjugate(frame.rotation), {0, 0, 1});
      for (std::size_t i = 0; i < hull.vertices.size(); ++i) {
        const double gap = frame(hull.vertices[i]).z;
        bool rises = false, falls = false;
        for (std::int32_t j : hull.neighbours[i]) {
          const Vec3 edge = hull.vertices[j] - hull.vertices[i];
          rises |= dot(up, edge) > 0.1 * norm(edge);
          falls |= dot(up, edge) < -0.1 * norm(edge);
        }
        if (gap <= margin && (rises || !falls))
          expected.push_back({frame(hull.vertices[i]) - Vec3{0, 0, 0.5 * gap}, {0, 0, 1}, gap});
      }
      const auto found = contacts(shape, frame, Plane{}, {}, margin);
      CHECK(found.size() == expected.size());
      for (std::size_t i = 0; i < std::min(found.size(), expected.size()); ++i)
        CHECK_NEAR(norm(found[i].point - expected[i].point), 0, 1e-15);
    }
  }
}
