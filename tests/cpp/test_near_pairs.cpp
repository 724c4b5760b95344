// How long the list of pairs of a model of many geoms holds, and that its age changes no contact.
#include <memory>

#include "amontons/multibody/joints/coordinates.hpp"
#include "check.hpp"
#include "collision_scenes.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "random.hpp"

using namespace scenes;

namespace {

// Balls, or balls and boxes in turn, of 0.1 m on a lattice above a plane and beside a box of the world.
ModelDescription heap(int side, bool boxes) {
  ModelDescription d;
  const auto add = [&](Index body, Shape shape, const Vec3& at = {}) {
    Geom geom;
    geom.body = body;
    geom.shape = std::move(shape);
    geom.frame.position = at;
    d.geoms.push_back(geom);
  };
  add(world, Plane{});
  add(world, Box{{0.1, 2, 2}}, {-0.2, 0, 0});
  for (int i = 0; i < side * side * side; ++i) {
    Body body;
    body.mass = 1;
    body.inertia = Mat3::diagonal(1, 1, 1);
    body.pose.position = {0.2 * (i % side), 0.2 * (i / side % side), 0.1 + 0.2 * (i / side / side)};
    d.bodies.push_back(body);
    if (boxes && i % 2)
      add(i, Box{{0.1, 0.09, 0.1}});
    else
      add(i, Sphere{0.1});
  }
  return d;
}

// Bodies that move with given velocities, and a finder with a memory whose searches are counted.
struct Walk {
  Model model;
  State state;
  BodyFrames frames;
  ContactFinder finder;
  PairSearch counter;
  int searches = 0;
  double h = 0.01, margin = 2e-3;

  explicit Walk(const ModelDescription& d) : model(d), state(initial_state(model)) {
    counter.find = [this](const BoxOrder& order, std::vector<IndexPair>& pairs) {
      ++searches;
      BroadPhase().find_pairs(order.bounds, pairs);
      std::erase_if(pairs,
                    [](const IndexPair& pair) { return pair.first == 0; });  // the plane is not asked for
      return std::size_t{1};
    };
  }
  std::vector<Contact> find(ContactFinder& by, const BodyVelocities& v, bool counts) {
    BodyMobilities mobility;
    BodyVelocities start;
    place_bodies(model, state, frames, mobility, start);
    std::vector<Contact> found;
    by.find({model, frames, v, h, margin, 1, counts ? &counter : nullptr}, found);
    return found;
  }
  // Whether the finder finds what one without a memory does.
  bool finds_the_same(const BodyVelocities& v) {
    ContactFinder without;
    const std::vector<Contact> now = find(finder, v, true), afresh = find(without, v, false);
    return std::equal(now.begin(), now.end(), afresh.begin(), afresh.end(),
                      [](const Contact& c, const Contact& d) {
                        return c.geom_a == d.geom_a && c.geom_b == d.geom_b && c.point == d.point &&
                               c.normal == d.normal && c.gap == d.gap;
                      });
  }
  void go_on(const BodyVelocities& v) {
    for (std::size_t i = 0; i < v.size(); ++i) state.positions[i] += h * v[i].linear;
  }
};

// What the weight of a step adds to velocities.
BodyVelocities fall(BodyVelocities v) {
  for (BodyVelocity& body : v) body.linear.z -= 0.1;
  return v;
}

}  // namespace

// Breaks when a pair is lost because a body left its grown extent unnoticed: by its place, by a longer way
// within the step, or by a turn that widens its box; or when the contacts of an old list come in another
// order.
TEST(contacts_do_not_depend_on_the_age_of_the_list) {
  for (const bool boxes : {false, true})
    for (const double speed : {1e-3, 0.02, 0.3, 5.0}) {
      Walk walk(heap(5, boxes));
      small::Draws random(7);
      BodyVelocities v(walk.model.bodies());
      int steps = 0;
      for (; steps < 25; ++steps) {
        for (BodyVelocity& body : v)
          for (int i = 0; i < 3; ++i) {
            body.linear[i] = 0.5 * body.linear[i] + random.uniform(-speed, speed);
            body.angular[i] = random.uniform(-speed, speed);
          }
        CHECK(walk.finds_the_same(fall(v)));
        walk.go_on(v);
      }
      CHECK(walk.searches >= 1);
      CHECK(speed > 0.02 || walk.searches <= 5);
    }
}

// A heap under its weight, whose bodies a correction of positions moves by a little, is searched once. What
// falls onto it keeps a list for more than a step. Breaks when each look searches anew, or when bodies at
// rest have no slack.
TEST(a_heap_at_rest_is_searched_once) {
  Walk walk(heap(5, false));
  BodyVelocities none(walk.model.bodies()), shift = none;
  for (int step = 0; step < 20; ++step) {
    walk.find(walk.finder, fall(none), true);
    for (std::size_t i = 0; i < shift.size(); ++i)
      shift[i].linear.x = (i + static_cast<std::size_t>(step)) % 2 ? 1e-3 : -1e-3;
    walk.go_on(shift);
    walk.find(walk.finder, fall(none), true);
  }
  CHECK(walk.searches == 1);
  BodyVelocities one = none;
  one.back().linear.z = -0.3;
  for (int step = 0; step < 12; ++step, walk.go_on(one)) walk.find(walk.finder, fall(one), true);
  CHECK(walk.searches <= 1 + 6);
}
