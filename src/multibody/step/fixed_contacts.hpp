// What a step that is not solved, or a correction of positions that ends early, may not do: lose bodies
// through what stands still.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/model/model.hpp"
#include "multibody/contacts/contact_law.hpp"

namespace amontons {

// Rigid contacts with what does not move, the velocities of which the bodies v shall not fall below.
struct FixedContacts {
  const Model& model;
  const BodyMobilities& mobility;
  std::span<const Contact> contacts;
  std::span<const double> least;  // m/s, along the normal of each contact
  // Of position (m), and the step (s): bodies of joints, which come apart, stop where they are many errors
  // deep, or would leave.
  double error, h;
  // At the start of the step, for velocities whose spins are slowed beside it; null for displacements.
  const BodyVelocities* start = nullptr;
};
// Changes v; the normal impulses that do it, one for each contact, each of which takes kinetic energy away.
// Empty if there is nothing to stop.
std::span<const double> stop_at_fixed(const FixedContacts& contacts, BodyVelocities& v);
// Of bodies that spin by more than half a radian within h, and faster than at the start: no more than that.
// What is light is spun by any angle where it is not solved, which no row of a contact foresees.
void slow_spins(const Model& model, const BodyVelocities& start, double h, BodyVelocities& v);

}  // namespace amontons
