// Which points of the pairs of a model become contacts, against all points of the narrow phase.
#include <algorithm>
#include <cmath>
#include <memory>

#include "amontons/multibody/joints/coordinates.hpp"
#include "check.hpp"
#include "collision_scenes.hpp"
#include "multibody/contacts/contact_finder.hpp"

using namespace scenes;

namespace {

Body body_at(const Vec3& position, const Quat& rotation = {}) {
  Body body;
  body.mass = 1;
  body.inertia = Mat3::diagonal(1, 1, 1);
  body.pose = {position, rotation};
  return body;
}

Geom geom_of(Index body, Shape shape, const Vec3& position = {}) {
  Geom geom;
  geom.body = body;
  geom.shape = std::move(shape);
  geom.frame.position = position;
  return geom;
}

// A model with its frames, and the two searches of a step.
struct Search {
  Model model;
  BodyFrames frames;
  BodyVelocities start;
  std::vector<Contact> contacts;
  ContactFinder finder;
  double h = 0.01, margin = 2e-3;

  explicit Search(const ModelDescription& d) : model(d) {
    BodyMobilities mobility;
    place_bodies(model, initial_state(model), frames, mobility, start);
  }
  void find(const BodyVelocities& free) { finder.find({model, frames, free, h, margin}, contacts); }
  void look_ahead(const BodyVelocities& after) {
    finder.find_unforeseen({model, frames, after, h, margin}, contacts);
  }
  // What a search without a memory finds.
  std::vector<Contact> afresh(const BodyVelocities& free) const {
    std::vector<Contact> found;
    ContactFinder().find({model, frames, free, h, margin}, found);
    return found;
  }
};

bool same(const std::vector<Contact>& a, const std::vector<Contact>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Contact& c, const Contact& d) {
    return c.geom_a == d.geom_a && c.geom_b == d.geom_b && c.body_a == d.body_a && c.body_b == d.body_b &&
           c.point == d.point && c.normal == d.normal && c.gap == d.gap && c.r_a == d.r_a && c.r_b == d.r_b &&
           c.material == d.material && c.impulse == d.impulse;
  });
}

// Cubes of 0.2 m on a plane, a row of stacks that touch.
ModelDescription stacks(int columns, int high) {
  ModelDescription d;
  d.geoms.push_back(geom_of(world, Plane{}));
  for (int x = 0; x < columns; ++x)
    for (int z = 0; z < high; ++z) {
      d.bodies.push_back(body_at({0.2 * x, 0, 0.1 + 0.2 * z}));
      d.geoms.push_back(geom_of(static_cast<Index>(d.bodies.size()) - 1, Box{{0.1, 0.1, 0.1}}));
    }
  return d;
}

}  // namespace

// A drum of 120 sides that lies on a plane has some twenty corners within the margin, and rows for few of
// them. Should the solve turn it, on the spot, by an angle that nobody foresaw, the corners that this brings
// down come back. Fails if what was set aside is forgotten: the search for overlaps asks for a tenth of the
// margin, and here no corner gets as deep.
TEST(corners_that_a_turn_brings_down_come_back) {
  ModelDescription d;
  d.geoms.push_back(geom_of(world, Plane{}));
  d.bodies.push_back(body_at({0, 0, 0.1}, turn({1, 0, 0}, 1.5707963267948966)));
  d.geoms.push_back(geom_of(0, prism(120, 0.1, 0.03)));
  const auto lowest = [](const Search& s, const BodyVelocity& v) {
    double least = 0;
    for (const Contact& c : s.contacts)
      least = std::min(least, c.gap + s.h * dot(c.normal, v.linear + cross(v.angular, c.r_a)));
    return least;
  };
  const double tolerance = 2e-5;  // a hundredth of the margin
  int came = 0;
  for (double turned : {0.0, 0.005, 0.01, 0.02, 0.03, 0.04, 0.05}) {
    Search s(d);
    const BodyVelocities still{{}}, after{{{}, {0, turned / s.h, 0}}};
    s.find(still);
    const std::size_t known = s.contacts.size();
    CHECK(known >= 2 && known <= 8);
    const double before = lowest(s, after[0]);
    s.look_ahead(after);
    // The deepest point of a drum of radius r that turns as the rows see it: at r times the angle ahead, by r
    // a^2 / 2 deeper than the axis of the turn; corners stand 3 degrees apart.
    const double depth = -lowest(s, after[0]), exact = 0.1 * (1 - 1 / std::sqrt(1 + turned * turned));
    came += s.contacts.size() > known;
    CHECK((s.contacts.size() > known) == (lowest(s, after[0]) < before));
    CHECK(depth <= 0.1 * (std::sqrt(1 + turned * turned) - 1) + 1e-9);
    CHECK(depth >= exact - tolerance - 0.1 * 0.026 * 0.026 / 2);
  }
  CHECK(came >= 2);
}

// A hull that hovers within the margin, but farther off than a tenth of it, has no rows until a solve brings
// it down, and then those that it needs: four, of a box. Fails if links that pass each other at a millimetre
// cost rows for ever, or if what was left out goes through the floor.
TEST(hulls_out_of_reach_have_no_rows) {
  ModelDescription d;
  d.geoms.push_back(geom_of(world, Box{{1, 1, 0.1}}, {0, 0, -0.1}));
  d.bodies.push_back(body_at({0, 0, 0.1 + 1e-3}));
  d.geoms.push_back(geom_of(0, box_hull({0.1, 0.1, 0.1})));
  Search s(d);
  const BodyVelocities still{{}}, falling{{{0, 0, -0.15}, {}}}, hovering{{{0, 0, -0.07}, {}}};
  s.find(still);
  CHECK(s.contacts.empty());
  s.look_ahead(hovering);
  CHECK(s.contacts.empty());
  s.look_ahead(falling);
  CHECK(s.contacts.size() == 4);
  s.find(falling);
  CHECK(s.contacts.size() == 4);
}

// Boxes keep each point that is within the margin, also in the air. Fails if the choice among corners of
// hulls is made for them too: forces of scenes with boxes would change for no gain.
TEST(boxes_keep_all_their_points) {
  ModelDescription d;
  d.geoms.push_back(geom_of(world, Plane{}));
  d.bodies.push_back(body_at({0, 0, 0.1005}, turn({0, 1, 0}, 5e-3)));
  d.geoms.push_back(geom_of(0, Box{{0.1, 0.1, 0.1}}));
  Search s(d);
  s.find({{}});
  CHECK(s.contacts.size() == 4);
}

// A shape that overlaps by much and turns has each of its points once: what the rows know of is no news.
// Fails if every look after a solve adds the same overlap again.
TEST(known_overlaps_are_not_found_again) {
  ModelDescription d;
  d.bodies = {body_at({0, 0, 0}), body_at({0.05, 0.02, 0})};
  d.geoms = {geom_of(0, Capsule{0.1, 0.2}), geom_of(1, Capsule{0.1, 0.1})};
  Search s(d);
  const BodyVelocities turning{{{}, {0.1, 0.2, 0}}, {{}, {0, 0, 0.3}}};
  s.find(turning);
  const std::size_t known = s.contacts.size();
  CHECK(known > 0);
  s.look_ahead(turning);
  CHECK(s.contacts.size() == known);
}

// A heap beside a tilted plane, alone and with so many geoms far away that its pairs are found by the tree of
// boxes. Fails if the list of pairs of few geoms lacks one, has one that may not touch, or has another order;
// and if a body is taken for one above the plane that reaches it within the step.
TEST(pairs_of_few_geoms_are_those_of_the_tree) {
  Random random;
  for (int k = 0; k < 20; ++k) {
    ModelDescription few;
    few.geoms.push_back(geom_of(world, Plane{}));
    few.geoms[0].frame = {{0, 0, -0.5}, turn(random.vector(), 0.5)};
    for (Index body = 0; body < 30; ++body) {
      few.bodies.push_back(body_at(random.vector(), random.rotation()));
      few.geoms.push_back(geom_of(body, Box{{0.2, 0.15, 0.1}}));
      few.geoms.push_back(geom_of(body, Capsule{0.05, 0.2}, 0.1 * random.vector()));
      few.geoms.back().category = few.geoms.back().mask = body % 3 ? 1 : 2;
    }
    few.excluded_bodies = {{0, 1}, {5, 2}};
    ModelDescription many = few;
    for (int far = 0; far < 10; ++far) many.geoms.push_back(geom_of(world, Sphere{0.1}, {0, 0, 1e3 + far}));
    Search listed(few), searched(many);
    CHECK(listed.model.lists_pairs() && !searched.model.lists_pairs());
    BodyVelocities free = listed.start;
    for (BodyVelocity& v : free) v = {3.0 * random.vector(), 10.0 * random.vector()};
    listed.find(free);
    searched.find(free);
    CHECK(listed.contacts.size() > 30 && listed.contacts.size() == searched.contacts.size());
    for (std::size_t i = 0; i < std::min(listed.contacts.size(), searched.contacts.size()); ++i) {
      const Contact &a = listed.contacts[i], &b = searched.contacts[i];
      CHECK(a.geom_a == b.geom_a && a.geom_b == b.geom_b && a.point == b.point && a.gap == b.gap);
    }
    // All points of the narrow phase with the plane, whose boxes were not asked for.
    std::size_t on_plane = 0, expected = 0;
    for (const Contact& c : listed.contacts) on_plane += c.geom_b == 0;
    for (std::size_t g = 1; g < few.geoms.size(); ++g) {
      if (!listed.model.may_touch(static_cast<Index>(g), 0)) continue;
      const Index body = few.geoms[g].body;
      const BodyFrame& frame = listed.frames[body];
      for (const ContactPoint& p :
           contacts(few.geoms[g].shape, frame.pose * few.geoms[g].frame, Plane{}, few.geoms[0].frame, 1)) {
        const Vec3 v = free[body].linear + cross(free[body].angular, p.point - frame.centre);
        expected += p.gap <= listed.margin || p.gap + listed.h * dot(p.normal, v) <= listed.margin;
      }
    }
    CHECK(on_plane == expected && expected > 0);
  }
}

// Pairs whose bodies have not changed keep their contacts. Fails if a contact survives the smallest change of
// a pose, of a velocity, of the step or of the margin, if impulses of the last step come back, or if the
// pairs that stand lose their order among those that move.
TEST(standing_pairs_have_the_contacts_of_a_search_afresh) {
  Search s(stacks(4, 3));
  BodyVelocities free = s.start;
  for (BodyVelocity& v : free) v.linear.z = -0.1;
  for (int k = 0; k < 12; ++k) {
    s.find(free);
    CHECK(!s.contacts.empty() && same(s.contacts, s.afresh(free)));
    for (Contact& c : s.contacts) c.impulse = {1, 2, 3};
    const auto body = static_cast<std::size_t>(k);
    if (k % 4 == 1) {
      s.frames[body].pose.position.x = std::nextafter(s.frames[body].pose.position.x, 1);
      s.frames[body].centre = s.frames[body].pose.position;
    }
    if (k % 4 == 2) free[body].angular.y = 1e-300;
    if (k == 7) s.h *= 2;
    if (k == 11) s.margin *= 2;
  }
}

// Fails if the parts that threads search overlap, leave out a pair, divide a pair, or come back in another
// order; if what one part keeps for the next search is not that of another; and if the poses later in the
// step are found otherwise where threads share them.
TEST(threads_find_the_same_contacts) {
  ModelDescription d;
  Random random;
  for (int k = 0; k < 1500; ++k) {
    d.bodies.push_back(body_at(random.vector(), random.rotation()));
    d.geoms.push_back(geom_of(k, k % 2 ? Shape(Sphere{0.12}) : Shape(Box{{0.1, 0.05, 0.05}})));
  }
  Search one(d), many(d);
  BodyVelocities free = one.start;
  for (BodyVelocity& v : free) v = {0.1 * random.vector(), 2.0 * random.vector()};
  const auto reach = [](const Search& s, const BodyVelocities& v, unsigned threads) {
    return Reach{s.model, s.frames, v, s.h, s.margin, threads};
  };
  for (std::size_t search = 0; search < 3; ++search) {
    one.find(free);
    many.finder.find(reach(many, free, 3), many.contacts);
    CHECK(one.contacts.size() > 4000 && same(one.contacts, many.contacts));
    std::vector<Vec3> turns, shared;
    one.finder.find_turns(reach(one, free, 1), one.contacts, 0, turns);
    many.finder.find_turns(reach(many, free, 3), many.contacts, 0, shared);
    CHECK(turns == shared && std::count(turns.begin(), turns.end(), Vec3{}) + 1000 < std::ssize(turns));
    BodyVelocities after = free;
    for (BodyVelocity& v : after) v = {0.5 * random.vector(), 8.0 * random.vector()};
    const std::size_t known = one.contacts.size();
    one.look_ahead(after);
    many.finder.find_unforeseen(reach(many, after, 3), many.contacts);
    CHECK(one.contacts.size() > known && same(one.contacts, many.contacts));
    free[search].linear.x += 0.1;
  }
}

// A blow changes the velocity of a few balls of a heap: only their pairs are searched again. Fails if a pair
// of a ball that was struck with one that was not is left out.
TEST(a_blow_is_followed_wherever_it_leads) {
  ModelDescription d;
  for (int k = 0; k < 60; ++k) {
    d.bodies.push_back(body_at({0.3 * k, 0, 0}));
    d.geoms.push_back(geom_of(k, Sphere{0.1}));
  }
  for (std::size_t struck : {0u, 30u, 59u}) {
    Search s(d);
    s.find(s.start);
    CHECK(s.contacts.empty());
    BodyVelocities after = s.start;
    after[struck].linear.x = struck == 59 ? -15 : 15;
    s.look_ahead(after);
    CHECK(s.contacts.size() == 1);
    const Contact& c = s.contacts[0];
    CHECK(std::max(c.geom_a, c.geom_b) == (struck == 59 ? 59 : static_cast<Index>(struck) + 1));
  }
}

// A ball on the end of an arm comes down along an arc, which its first contact does not foresee; a ball that
// spins about its own centre keeps its one contact. Fails if the search in later poses passes over both.
TEST(a_ball_that_a_turn_brings_down_is_followed) {
  for (const double arm : {0.0, 0.3}) {
    ModelDescription d;
    d.geoms.push_back(geom_of(world, Plane{}));
    d.bodies.push_back(body_at({0, 0, 0.101 - arm}));
    d.geoms.push_back(geom_of(0, Sphere{0.1}, {0, 0, arm}));
    Search s(d);
    s.start[0].angular = {0, 20, 0};
    s.find(s.start);
    CHECK(s.contacts.size() == 1);
    s.look_ahead(s.start);
    CHECK(s.contacts.size() == (arm > 0 ? 2u : 1u));
  }
}

// A ball or a capsule that rests on a slab presses on a ball sunk into the ground, which does not rise above
// the top of the slab. Round shapes have no edge that could be flush with it. Breaks when such a pair gets
// the normal of the slab, as the side of a flush neighbour does, or when the slab changes its contact at all.
TEST(round_shapes_have_no_internal_edges) {
  for (const bool capsule : {false, true}) {
    const auto found = [&](bool slab) {
      ModelDescription d;
      d.geoms.push_back(geom_of(world, Sphere{0.1}, {0.02, 0, -0.1}));
      d.bodies.push_back(body_at({0, 0, 0.099}));
      d.geoms.push_back(geom_of(0, capsule ? Shape{Capsule{0.1, 0.05}} : Shape{Sphere{0.1}}));
      d.geoms[1].frame.rotation = turn({1, 0, 0}, 1.5707963267948966);
      if (slab) d.geoms.push_back(geom_of(world, Box{{0.2, 0.2, 0.1}}, {-0.2, 0, -0.1}));
      Search s(d);
      s.find({{{0, 0, -0.1}, {}}});
      CHECK(s.contacts.size() >= (slab ? 2 : 1));
      const auto of_balls = std::find_if(s.contacts.begin(), s.contacts.end(),
                                         [](const Contact& c) { return std::min(c.geom_a, c.geom_b) == 0; });
      CHECK(of_balls != s.contacts.end());
      return *of_balls;
    };
    const Contact alone = found(false), beside = found(true);
    CHECK(same({alone}, {beside}));
    const Vec3 apart{-0.02, 0, 0.199};
    CHECK_NEAR(norm(beside.normal - apart / norm(apart)), 0, 1e-12);
  }
}
