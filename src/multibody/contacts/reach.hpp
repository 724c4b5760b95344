// What a search for contacts reads.
#pragma once
#include "amontons/multibody/bodies/bodies.hpp"
#include "amontons/problem/contact.hpp"
#include "multibody/contacts/contact_law.hpp"

namespace amontons {

// Where bodies stand, where the velocities v take them over h, and up to which gap points count.
struct Reach {
  const Model& model;
  const BodyFrames& bodies;
  const BodyVelocities& v;
  double h, margin;
};

// How fast the gap of a contact opens, and what it is at the end of the step.
inline double opening(const Contact& c, const BodyVelocities& v) {
  return dot(c.normal, relative_motion(c, v).linear);
}
inline double end_gap(const Contact& c, const Reach& reach) { return c.gap + reach.h * opening(c, reach.v); }

}  // namespace amontons
