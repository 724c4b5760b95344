// Every tuned number of joints, with its unit, its reason, and the test that protects it.
// tools/check_policy.py finds numbers elsewhere.
#pragma once
#include "amontons/base/policy.hpp"

namespace amontons::joints {

struct Policy {
  // Compliance (relative to D M^-1 D' of the row times Model::lightness): makes redundant locked rows share
  // the load evenly. Such rows (two hinges of a door, planar loops) make A singular. Not larger: a row sags
  // by this fraction of g h^2, 2e-11 m for a body on one joint, times the carried masses over the heaviest of
  // its mechanism. Relative to D M^-1 D' alone a link of 1e-6 kg would let a trunk of 17 kg sink at 30 mm/s.
  // Not smaller: positions are rounded to 1e-16 of their size. That error, over h and over this compliance,
  // is a load between redundant rows, below 1e-4 of the weight.
  double compliance = 1e-7;
  // Mass (relative to the lightest part of its row): of an auxiliary body; the error of the momentum.
  double auxiliary_mass = 1e-5;
  // Reach (relative to Model::length, or rad): of limits beyond the fastest known velocity, for the effect of
  // collisions and other joints. A missed limit is corrected in the next step, as a violation.
  double reach = 0.1;

  // Coordinates from poses.

  // Step (radians or lengths): a fit has converged below it; the rest is rounding, or negligible beside the
  // error of the joint. Coordinates then do not drift in a scene at rest, where each step makes one more.
  // Also the squared error (rad^2) of a fit that is good, so that no other start is tried.
  double smallest_step = 1e-7;

  // Singular poses.

  // Manipulability (relative to axes at right angles): below it duals are damped. Its square is the largest
  // damping, at the singular pose.
  double regular = 1e-3;
  // Rounding (relative): of a length or a sine to zero, which then has no direction, and of a column beside
  // others. The number of locked wrenches is then that of the model in every pose. Also of the work of a
  // wrench along a degree of freedom, of a natural map to that of zero impulses, of a velocity error to the
  // fastest body. A body of a tree that is farther from the pose of its coordinates was moved by the user.
  double rounding = 1e-12;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named = name_policy("joints", {{"compliance", &policy.compliance},
                                                 {"auxiliary_mass", &policy.auxiliary_mass},
                                                 {"reach", &policy.reach},
                                                 {"smallest_step", &policy.smallest_step},
                                                 {"regular", &policy.regular},
                                                 {"rounding", &policy.rounding}});

}  // namespace amontons::joints
