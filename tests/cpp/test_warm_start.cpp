// Which impulses of the last step the contacts of this one start from.
#include <algorithm>
#include <initializer_list>

#include "amontons/multibody/joints/coordinates.hpp"
#include "check.hpp"
#include "multibody/contacts/pair_order.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "problems.hpp"

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
  // At x along the box; of the last step with the normal impulse z.
  Contact at(double x) const {
    Contact c = contact_between(0, world, {x, 0, 0}, {x, 0, 0}, {0, 0, 1});
    c.geom_a = 1;
    c.geom_b = 0;
    c.point = {x, 0, 0};
    return c;
  }
  CarriedContact at(double x, double z) const {
    return {1, 0, inverse(frames[0].pose)(at(x).point), {0, 0, z}, {}};
  }
  std::vector<double> normals(const std::vector<CarriedContact>& last,
                              const std::vector<Contact>& now) const {
    std::vector<double> x0, z;
    std::vector<Index> known;
    find_known(model, last, frames, now, known);
    warm_start_contacts(last, known, 1, now, x0);
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

namespace {

// Contacts of a pile in the order of a search: pairs ascend before the fixed geom 0 becomes the second one.
// Some pairs occur again at the end, as contacts that were added later do.
std::vector<Contact> contacts_of_a_pile(Index geoms) {
  std::vector<Contact> contacts;
  small::Random random(3);
  const auto add = [&](Index a, Index b) {
    Contact c = contact_between(a - 1, b - 1, {}, {}, {0, 0, 1});
    c.geom_a = a;
    c.geom_b = b;
    contacts.push_back(c);
  };
  for (Index a = 1; a < geoms; ++a)
    if (random.uniform(0, 1) < 0.5) add(a, 0);
  for (Index a = 1; a < geoms; ++a)
    for (Index b = a + 1; b < geoms; ++b)
      if (random.uniform(0, 1) < 0.3) add(a, b);
  for (Index a = 1; a + 1 < geoms; a += 7) add(a, a + 1);
  return contacts;
}

}  // namespace

// Fails if the sort in linear time loses a contact, or changes the order within a pair.
TEST(pairs_are_sorted_as_by_a_stable_sort) {
  std::vector<Contact> contacts = contacts_of_a_pile(40);
  contacts.push_back(contact_between(0, world, {}, {}, {0, 0, 1}));  // without geoms
  std::vector<PairKey> keys, expected;
  sort_by_pair(contacts, keys, [](std::size_t i) { return i % 5 != 0; });
  for (std::uint32_t i = 0; i < contacts.size(); ++i)
    if (i % 5 != 0) expected.push_back({pair_of(contacts[i]), i});
  std::stable_sort(expected.begin(), expected.end(),
                   [](const PairKey& a, const PairKey& b) { return a.pair < b.pair; });
  CHECK(keys.size() == expected.size());
  for (std::size_t k = 0; k < keys.size(); ++k) {
    CHECK(keys[k].pair == expected[k].pair);
    CHECK(keys[k].contact == expected[k].contact);
  }
}

// Fails if the search that goes on from the last pair passes by a pair, or stays behind one.
TEST(each_pair_of_a_pile_finds_its_impulse) {
  constexpr Index geoms = 40;
  ModelDescription d;
  d.geoms.resize(geoms);
  d.geoms[0].shape = Plane{};
  for (Index g = 1; g < geoms; ++g) {
    d.bodies.emplace_back();
    d.bodies.back().mass = 1;
    d.bodies.back().inertia = Mat3::diagonal(1, 1, 1);
    d.geoms[static_cast<std::size_t>(g)].body = g - 1;
    d.geoms[static_cast<std::size_t>(g)].shape = Sphere{0.1};
  }
  const Model model(d);
  BodyFrames frames;
  BodyMobilities mobility;
  BodyVelocities velocities;
  place_bodies(model, initial_state(model), frames, mobility, velocities);
  std::vector<Contact> now = contacts_of_a_pile(geoms);
  std::vector<CarriedContact> last;
  std::vector<PairKey> keys;
  sort_by_pair(now, keys, [](std::size_t i) { return i % 3 != 0; });
  for (const PairKey& key : keys) {
    if (!last.empty() && pair_of(last.back()) == key.pair) continue;
    last.push_back(
        {key.pair.first, key.pair.second, {}, {0, 0, 1.0 + key.pair.first + geoms * key.pair.second}, {}});
  }
  now.resize(now.size() - 6);  // one contact per pair
  std::vector<double> x0;
  std::vector<Index> known;
  find_known(model, last, frames, now, known);
  warm_start_contacts(last, known, 1, now, x0);
  for (std::size_t i = 0; i < now.size(); ++i) {
    const auto was = std::find_if(last.begin(), last.end(),
                                  [&](const CarriedContact& c) { return pair_of(c) == pair_of(now[i]); });
    CHECK(x0[3 * i] == (was == last.end() ? 0 : was->impulse.z));
  }
}
