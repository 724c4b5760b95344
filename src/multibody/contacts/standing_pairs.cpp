// A body at rest has the same pose and the same free velocity in each step. Gravity and held loads are those
// of the last step, and the solve has stopped the body to the bit. Its pairs with other bodies at rest, and
// with the world, then have the contacts of the last search. A body that moves has new bits in each step. It
// keeps nothing and costs one comparison.
//
// Each search writes the whole list again. A list that is changed in place would have to know which of its
// pairs have left.
#include "multibody/contacts/standing_pairs.hpp"

#include <algorithm>
#include <cstring>
#include <type_traits>

namespace amontons {

namespace {

// Bits and not values: a zero of the other sign is a change.
template <class T>
bool same_bits(const T& a, const T& b) {
  static_assert(std::is_trivially_copyable_v<T>);
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

}  // namespace

void StandingPairs::Kept::clear() {
  pairs.clear();
  contacts.clear();
}

void StandingPairs::Kept::add(const IndexPair& geoms, std::span<const Contact> found) {
  pairs.push_back({geoms, contacts.size(), contacts.size() + found.size()});
  contacts.insert(contacts.end(), found.begin(), found.end());
}

void StandingPairs::Kept::append(const Kept& later) {
  const std::size_t before = contacts.size();
  for (const Pair& p : later.pairs) pairs.push_back({p.geoms, before + p.first, before + p.end});
  contacts.insert(contacts.end(), later.contacts.begin(), later.contacts.end());
}

void StandingPairs::begin(const Reach& reach) {
  const std::size_t bodies = reach.bodies.size();
  const bool comparable = poses_.size() == bodies && h_ == reach.h && margin_ == reach.margin;
  poses_.resize(bodies);
  velocities_.resize(bodies);
  stands_.resize(bodies);
  // A body asleep stands.
  if (reach.visited.bodies.only) std::fill(stands_.begin(), stands_.end(), 1);
  reach.visited.bodies.each(bodies, [&](std::size_t i) {
    const Transform& pose = reach.bodies[i].pose;
    stands_[i] = comparable && same_bits(poses_[i], pose) && same_bits(velocities_[i], reach.v[i]);
    poses_[i] = pose;
    velocities_[i] = reach.v[i];
  });
  h_ = reach.h;
  margin_ = reach.margin;
}

StandingPairs::Cursor StandingPairs::at(const IndexPair& geoms) const {
  const auto before = [](const Kept::Pair& p, const IndexPair& pair) { return p.geoms < pair; };
  const auto found = std::lower_bound(kept_.pairs.begin(), kept_.pairs.end(), geoms, before);
  return static_cast<Cursor>(found - kept_.pairs.begin());
}

// Both lists ascend, so that the cursor only moves forward: all pairs of a search take one pass over those
// kept.
const StandingPairs::Kept::Pair* StandingPairs::find(const IndexPair& geoms, Cursor& from) const {
  while (from < kept_.pairs.size() && kept_.pairs[from].geoms < geoms) ++from;
  return from < kept_.pairs.size() && kept_.pairs[from].geoms == geoms ? &kept_.pairs[from] : nullptr;
}

std::span<const Contact> StandingPairs::contacts(const Kept::Pair& pair) const {
  return std::span(kept_.contacts).subspan(pair.first, pair.end - pair.first);
}

}  // namespace amontons
