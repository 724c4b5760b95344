// Every tuned number of trees, with its unit, its reason, and the test or benchmark that protects it.
// tools/check_policy.py finds numbers elsewhere.
#pragma once
#include "amontons/base/policy.hpp"

namespace amontons::trees {

struct Policy {
  // Change of rates (relative to the fastest): these rounds end if the next one would change them less.
  double rate_precision = 1e-9;
  // Error (relative to the fastest rate, or to the kinetic energy): of rounds that are worth their result.
  // More is left where coordinates turn by radians within a step (a chain that snaps straight, test_trees).
  double most_left = 1e-3;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named =
    name_policy("trees", {{"rate_precision", &policy.rate_precision}, {"most_left", &policy.most_left}});

}  // namespace amontons::trees
