// Which impulses of the last step the contacts of this one start from.
#include <initializer_list>

#include "amontons/multibody/joints/coordinates.hpp"
#include "check.hpp"
#include "multibody/contacts/warm_start.hpp"

using namespace amontons;

namespace {

// A box on a plane, and points of the two.
struct Pair {
  Model model{description()};
  BodyFrames frames;

  Pair() {
    BodyMobilities mobility;
    BodyVelocities velocities;
    place_bodies(model, initial_state(model), frames, mobility, velocities);
  }
  static ModelDescription description() {
    ModelDescription d;
    d.bodies.emplace_back();
    d.bodies[0].mass = 1;
    d.bodies[0].inertia = Mat3::diagonal(1, 1, 1);
    d.geoms.resize(2);
    d.geoms[0].shape = Plane{};
    d.geoms[1].body = 0;
    d.geoms[1].shape = Box{{0.1, 0.1, 0.1}};
    return d;
  }
  // At x along the box, with the normal impulse z.
  Contact at(double x, double z = 0) const {
    Contact c = contact_between(0, world, {x, 0, 0}, {x, 0, 0}, {0, 0, 1});
    c.geom_a = 1;
    c.geom_b = 0;
    c.point = {x, 0, 0};
    c.local = inverse(frames[0].pose)(c.point);
    c.impulse = {0, 0, z};
    return c;
  }
  std::vector<double> normals(const std::vector<Contact>& last, const std::vector<Contact>& now) const {
    std::vector<double> x0, z;
    warm_start_contacts(model, last, 1, frames, now, x0);
    for (std::size_t i = 0; i < x0.size(); i += 3) z.push_back(x0[i]);
    return z;
  }
};

}  // namespace

// A foot that rolls over its middle corner: those beside it carry nothing and are not among the last. Fails
// if the first point within reach takes the impulse, from which the solve then starts at another corner.
TEST(an_impulse_goes_to_the_nearest_point) {
  const Pair pair;
  CHECK((pair.normals({pair.at(0, 2)}, {pair.at(-2e-3), pair.at(1e-4), pair.at(2e-3)}) ==
         std::vector<double>{0, 2, 0}));
}

// Two corners that moved the same way: the nearest two are matched first, and the other takes what is left.
// Fails if an impulse is counted twice, or goes beyond the reach of a quarter of the box.
TEST(no_impulse_is_taken_twice) {
  const Pair pair;
  CHECK((pair.normals({pair.at(0, 2), pair.at(0.01, 3)}, {pair.at(4e-3), pair.at(0.011)}) ==
         std::vector<double>{2, 3}));
  CHECK((pair.normals({pair.at(0, 2)}, {pair.at(1e-3), pair.at(2e-3)}) == std::vector<double>{2, 0}));
  CHECK((pair.normals({pair.at(-0.1, 2)}, {pair.at(0), pair.at(0.1)}) == std::vector<double>{0, 0}));
}
