#pragma once
#include "amontons/base/elementary.hpp"

namespace amontons {

// The coefficient (or limit) of dry friction at a rate of slip, Stribeck's curve in the form of Bo and
// Pavelescu (Wear 82, 1982): kinetic + (stuck - kinetic) exp(-(slip / speed)^2). Without a speed it falls at
// once. A negative `stuck` means that there is one coefficient. `slip` is that of the last step, 0 if it
// stuck.
inline double friction_at(double kinetic, double stuck, double speed, double slip) {
  if (stuck < 0) return kinetic;
  if (slip == 0) return stuck;
  if (!(speed > 0)) return kinetic;
  const double ratio = slip / speed;
  // exp of a large argument is zero anyway; its square may overflow.
  if (!(ratio < 30)) return kinetic;
  return kinetic + (stuck - kinetic) * (1 + elementary::expm1(-ratio * ratio));
}

}  // namespace amontons
