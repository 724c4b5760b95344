#include <cmath>

#include "check.hpp"
#include "collision/pairs/general.hpp"
#include "collision/pairs/pair.hpp"
#include "collision_scenes.hpp"

// The narrow phase, what holds for all pairs: swapping, units, motion, the margin.
using namespace scenes;

namespace {

const Quat straight;

struct Named {
  const char* name;
  Shape shape;
};
std::vector<Named> all_convex() {
  return {{"sphere", Sphere{0.3}},
          {"capsule", Capsule{0.1, 0.4}},
          {"box", Box{{0.5, 0.3, 0.2}}},
          {"cylinder", Cylinder{0.4, 0.3}},
          {"ellipsoid", Ellipsoid{{0.5, 0.3, 0.2}}},
          {"hull", prism(5, 0.4, 0.3)}};
}
Shape scaled(const Shape& shape, double unit) {
  if (const auto* s = std::get_if<Sphere>(&shape)) return Sphere{unit * s->radius};
  if (const auto* s = std::get_if<Capsule>(&shape)) return Capsule{unit * s->radius, unit * s->half_length};
  if (const auto* s = std::get_if<Box>(&shape)) return Box{unit * s->half};
  if (const auto* s = std::get_if<Cylinder>(&shape)) return Cylinder{unit * s->radius, unit * s->half_length};
  if (const auto* s = std::get_if<Ellipsoid>(&shape)) return Ellipsoid{unit * s->radii};
  if (std::holds_alternative<Hull>(shape)) return prism(5, 0.4 * unit, 0.3 * unit);
  return shape;
}

}  // namespace

// Fails if two shapes without a way to meet are taken for convex ones.
TEST(static_shapes_never_touch_each_other) {
  const std::vector<Vec3> corners{{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  const std::vector<std::array<std::int32_t, 3>> triangle{{0, 1, 2}};
  const Shape fixed[] = {Plane{}, make_mesh(corners, triangle),
                         make_height_field(std::vector<double>(4, 0.0), 2, 2, 2, 2)};
  for (const Shape& a : fixed)
    for (const Shape& b : fixed) CHECK(contacts(a, {}, b, {{0, 0, 0.01}, straight}, 1).empty());
}

// The table of pairs: a shape added without a row that holds it would pass through others; a row below the
// general one would never be used.
TEST(every_pair_has_a_way_and_special_ways_come_first) {
  using namespace collision;
  using collision::kind_of;  // in a batch with other files there is one of sets, too
  for (std::size_t a = 0; a < kind_count; ++a)
    for (std::size_t b = a; b < kind_count; ++b)
      CHECK((find_row(a, b) == nullptr) == (holds(static_kinds, a) && holds(static_kinds, b)));
  const auto is_general = [](std::size_t a, std::size_t b) {
    return find_row(a, b)->collide == collide_convex;
  };
  constexpr std::size_t sphere = kind_of<Sphere>(), capsule = kind_of<Capsule>(), box = kind_of<Box>();
  CHECK(!is_general(sphere, sphere) && !is_general(sphere, kind_of<Ellipsoid>()));
  CHECK(!is_general(capsule, capsule) && !is_general(box, box));
  CHECK(is_general(sphere, kind_of<Hull>()) && is_general(capsule, box));
  for (std::size_t a = 0; a <= kind_of<Hull>(); ++a)
    for (std::size_t b : {kind_of<Plane>(), kind_of<Mesh>(), kind_of<HeightField>()})
      CHECK(!is_general(a, b));
}

// Every bit: fails if a pair is treated in the order of its arguments.
TEST(swapping_the_shapes_only_turns_the_normals) {
  Random random;
  auto shapes = all_convex();
  shapes.push_back({"plane", Plane{}});
  int touching = 0;
  for (const Named& a : shapes)
    for (const Named& b : shapes)
      for (int k = 0; k < 200; ++k) {
        const Transform fa{0.5 * random.vector(), random.rotation()},
            fb{0.5 * random.vector(), random.rotation()};
        const auto one = contacts(a.shape, fa, b.shape, fb, 0.05),
                   two = contacts(b.shape, fb, a.shape, fa, 0.05);
        CHECK(one.size() == two.size());
        touching += !one.empty();
        for (std::size_t i = 0; i < std::min(one.size(), two.size()); ++i)
          CHECK(one[i].point == two[i].point && one[i].gap == two[i].gap && one[i].normal == -two[i].normal);
      }
  CHECK(touching > 5000);
}

TEST(results_do_not_depend_on_units) {
  int touching = 0;
  // 2^-20 and 2^20 scale without rounding: every bit must stay. Fails at any length that is
  // compared with a constant.
  Random random;
  auto shapes = all_convex();
  shapes.push_back({"plane", Plane{}});
  for (const Named& a : shapes)
    for (const Named& b : shapes)
      for (int k = 0; k < 100; ++k) {
        const Transform fa{0.5 * random.vector(), random.rotation()},
            fb{0.5 * random.vector(), random.rotation()};
        const auto metres = contacts(a.shape, fa, b.shape, fb, 0.0625);
        touching += !metres.empty();
        for (double unit : {std::ldexp(1, -20), std::ldexp(1, 20)}) {
          const auto other =
              contacts(scaled(a.shape, unit), {unit * fa.position, fa.rotation}, scaled(b.shape, unit),
                       {unit * fb.position, fb.rotation}, 0.0625 * unit);
          CHECK(other.size() == metres.size());
          for (std::size_t i = 0; i < std::min(other.size(), metres.size()); ++i)
            CHECK(other[i].point == unit * metres[i].point && other[i].gap == unit * metres[i].gap &&
                  other[i].normal == metres[i].normal);
        }
      }
  CHECK(touching > 2500);
}

TEST(results_move_with_the_bodies) {
  // A common motion of both bodies moves the contacts: fails where a direction or position of the world
  // enters. Resting poses are excluded: there, which of several equal ways out is taken may hang on rounding.
  int touching = 0;
  Random random;
  for (const Named& a : all_convex())
    for (const Named& b : all_convex())
      for (int k = 0; k < 100; ++k) {
        const Transform fa{0.4 * random.vector(), random.rotation()}, fb{{}, random.rotation()};
        const Transform motion{3.0 * random.vector(), random.rotation()};
        const auto here = contacts(a.shape, fa, b.shape, fb, 0.05),
                   there = contacts(a.shape, motion * fa, b.shape, motion * fb, 0.05);
        if (here.empty() && there.empty()) continue;
        ++touching;
        // Round bodies deep in each other: as far as EPA's points reach, which differ.
        CHECK_NEAR(least_gap(here), least_gap(there), least_gap(here) > -0.1 ? 1e-6 : 1e-3);
      }
  CHECK(touching > 1500);
}

TEST(the_margin_is_complete) {
  // What is found within a small margin is found within a larger one with the same gap; a margin of zero
  // finds every overlap. Fails if an early exit is too early.
  Random random;
  for (const Named& a : all_convex())
    for (const Named& b : all_convex())
      for (int k = 0; k < 200; ++k) {
        const Transform fa{0.6 * random.vector(), random.rotation()}, fb{{}, random.rotation()};
        const double wide = least_gap(contacts(a.shape, fa, b.shape, fb, 10));
        CHECK(std::isfinite(wide));
        for (double margin : {0.0, 0.01, 0.1}) {
          const auto found = contacts(a.shape, fa, b.shape, fb, margin);
          if (std::abs(wide - margin) < 1e-3) continue;
          CHECK(found.empty() == (wide > margin));
          for (const ContactPoint& c : found)
            CHECK(c.gap <= margin && is_finite(c.point) && is_finite(c.normal));
        }
      }
}
