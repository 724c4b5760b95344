#include "amontons/multibody/contacts/overlaps.hpp"

#include <algorithm>

#include "multibody/contacts/contact_finder.hpp"

namespace amontons {

// Uses the contact search of a step, with bodies at rest, so that both agree on overlaps.
std::vector<std::pair<Index, Index>> overlapping_geoms(const Model& model, const State& state, double depth) {
  BodyFrames frames;
  BodyMobilities mobility;
  BodyVelocities velocities;
  place_bodies(model, state, frames, mobility, velocities);
  const BodyVelocities rest(frames.size());
  ContactFinder finder;
  std::vector<Contact> contacts;
  finder.find({model, frames, rest, 0, 0}, contacts);
  std::vector<std::pair<Index, Index>> pairs;
  for (const Contact& c : contacts)
    if (c.gap < -depth) pairs.push_back(std::minmax(c.geom_a, c.geom_b));
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  return pairs;
}

}  // namespace amontons
