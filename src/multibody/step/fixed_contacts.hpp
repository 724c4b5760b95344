// Protection against losing bodies through fixed geometry, for unsolved steps and position corrections that
// end early.
#pragma once
#include <span>
#include <vector>

#include "amontons/multibody/model/model.hpp"
#include "multibody/contacts/contact_law.hpp"

namespace amontons {

// Rigid contacts with fixed geometry, and lower bounds for the normal velocities of the bodies v there.
struct FixedContacts {
  const Model& model;
  const BodyMobilities& mobility;
  std::span<const Contact> contacts;
  std::span<const double> least;  // m/s, along the normal of each contact
  double h;                       // s
  // Velocities at the start of the step, relative to which spins are limited; null for displacements.
  const BodyVelocities* start = nullptr;
};
// Changes v. Returns the normal impulses of the change, one per contact; each reduces kinetic energy. Empty
// if no body must be stopped.
std::span<const double> stop_at_fixed(const FixedContacts& contacts, BodyVelocities& v);
// Limits spins that exceed half a radian within h and are faster than at the start. An unsolved step can turn
// a light body by any angle, and no contact row foresees this.
void slow_spins(const Model& model, const BodyVelocities& start, double h, BodyVelocities& v);

}  // namespace amontons
