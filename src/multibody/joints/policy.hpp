// Every tuned number of joints, with its unit, its reason, and the test that protects it.
// tools/check_policy.py finds numbers elsewhere.
#pragma once
#include "amontons/base/policy.hpp"

namespace amontons::joints {

struct Policy {
  // Mass (relative to the lightest part of its row): of an auxiliary body; the error of the momentum. With
  // 1e-6 a robot with tendons (dm_suite/quadruped) takes half as many products again.
  double auxiliary_mass = 1e-5;
  // Reach (relative to Model::length, or rad): of limits beyond the fastest known velocity, for the effect of
  // collisions and other joints. A missed limit is corrected in the next step, as a violation.
  double reach = 0.1;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named =
    name_policy("joints", {{"auxiliary_mass", &policy.auxiliary_mass}, {"reach", &policy.reach}});

}  // namespace amontons::joints
