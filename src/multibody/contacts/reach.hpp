// Input of a search for contacts.
#pragma once
#include "amontons/collision/broad_phase.hpp"
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/multibody/contacts/sleepers.hpp"
#include "amontons/problem/contact.hpp"
#include "multibody/contacts/contact_law.hpp"

namespace amontons {

// Poses of the bodies, their velocities v over h, and the largest gap that counts. Threads: 0 for one per
// core. Pairs: who finds boxes that overlap; null: this library. Results depend on neither. Islands asleep
// keep their contacts, which no search tells.
struct Reach {
  const Model& model;
  const BodyFrames& bodies;
  const BodyVelocities& v;
  double h, margin;
  unsigned threads = 1;
  const PairSearch* pairs = nullptr;
  const Sleepers* asleep = nullptr;  // islands that stay; null: none
  Visited visited = {};  // bodies and geoms whose data a search makes; it keeps those of the others
  bool has_sleepers() const { return asleep && asleep->any(); }
  // For what a search on a device reads.
  const HostMemory& memory() const {
    static const HostMemory ordinary;
    return pairs ? pairs->memory : ordinary;
  }
};

// Speed at which the gap of a contact opens, and the gap at the end of the step.
inline double opening(const Contact& c, const BodyVelocities& v) {
  return dot(c.normal, relative_motion(c, v).linear);
}
inline double end_gap(const Contact& c, const Reach& reach) { return c.gap + reach.h * opening(c, reach.v); }

}  // namespace amontons
