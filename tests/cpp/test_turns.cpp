// What contacts that turn add to b: an ellipsoid that lies flat on a plane and rolls about its middle axis.
// The lowest point moves ahead of the centre, and with the spin w comes down by w times its offset.
#include <cmath>

#include "amontons/multibody/joints/coordinates.hpp"
#include "check.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/second_order.hpp"

using namespace amontons;

namespace {

constexpr double h = 0.01, margin = 2e-3, least = 1e-6;

ModelDescription ellipsoid_on_plane() {
  ModelDescription d;
  Geom ground, round;
  ground.shape = Plane{};
  round.shape = Ellipsoid{{0.3, 0.2, 0.1}};
  round.body = 0;
  Body body;
  body.mass = 1;
  body.inertia = Mat3::diagonal(1, 1, 1);
  body.pose = {{0, 0, 0.1}, {}};
  d.geoms = {ground, round};
  d.bodies = {body};
  return d;
}

struct Rolling {
  Model model{ellipsoid_on_plane()};
  BodyFrames frames;
  BodyMobilities mobility;
  BodyVelocities rest{BodyVelocity{}};
  ContactFinder finder;
  std::vector<Contact> contacts;
  Problem problem;
  std::vector<Vec3> turns;

  Rolling() {
    BodyVelocities start;
    place_bodies(model, initial_state(model), frames, mobility, start);
    finder.find({model, frames, rest, h, margin}, contacts);
    problem = assemble({frames, mobility, rest, rest}, contacts, {}, {h, h, 0});
  }
  bool turn(double spin) {
    const BodyVelocities v{{{}, {0, spin, 0}}};
    const bool turned = find_turns({model, frames, v, h, margin}, least, contacts, finder, turns);
    write_b(rest, contacts, {}, {h, h, 0}, turns, problem);
    return turned;
  }
};

}  // namespace

// Breaks when a point is not followed to the middle of the step: half of it turns by a = h w / 2, and the
// lowest point of an ellipse with the half axes p and q then leads by (p^2 - q^2) sin a cos a over the
// height.
TEST(rolling_contact_turns_by_the_lead_of_its_point) {
  Rolling rolling;
  CHECK(rolling.contacts.size() == 1);
  const double w = 10, a = 0.5 * h * w, s = std::sin(a), c = std::cos(a);
  const double offset = (0.09 - 0.01) * s * c / std::sqrt(0.09 * s * s + 0.01 * c * c);
  const double b = rolling.problem.b[0];
  CHECK(rolling.turn(w));
  CHECK(std::abs(std::abs(rolling.problem.b[0] - b) - w * offset) < 1e-6);
}

// Breaks when the turn stays in b of a contact that no longer turns, as after a prediction that was wrong.
TEST(turn_of_what_comes_to_rest_leaves_b) {
  Rolling rolling;
  const std::vector<double> b = rolling.problem.b;
  rolling.turn(10);
  CHECK(rolling.problem.b != b);
  rolling.turn(0);
  for (std::size_t i = 0; i < b.size(); ++i) CHECK(std::abs(rolling.problem.b[i] - b[i]) < 1e-12);
}
