// Every tuned number of the direct way, with its unit, its reason, and the test or benchmark that protects
// it. tools/check_policy.py finds numbers elsewhere.
#pragma once
#include <cstddef>

#include "amontons/base/policy.hpp"

namespace amontons::direct {

struct Policy {
  // Where the direct way applies.

  // Size (rows of an island, or its coordinates if these are fewer): at this size a dense factorisation takes
  // 1 ms, about as long as a first-order method. With 300 stacks of plates took 3 times as long, 15 times at
  // worst.
  std::size_t most_rows = 180;
  // Work (multiplications): limit of a factorisation of K, 10 ms. Trees need 2000 per body, loops that cross
  // may cause much fill; half of it is too little for benchmark B1.
  double most_factor_work = 2e7;

  // Accuracy.

  // Natural map (tolerances): where islands stop. Newton steps cost microseconds, and a scene at rest starts
  // its next step with the answer (test_rest).
  double aim = 1e-5;
  // Natural map (tolerances): target of islands, and of a first-order method on constrained bodies; the
  // remainder is left to the rounding of W and of K.
  double reduced_share = 0.9;

  // Search for faces.

  // Newton steps (count): that may pass without a better x, in all. With 5 a body leaves its room in steps of
  // 20 iterations (test_step_limits).
  std::size_t stale_steps = 4;
  // Projections (count): of a block in a sweep, with W of the block alone; a row needs one. Three take fewer
  // factorisations than one in most runs of robots on the floor (`benchmarks/robots.py --fall`).
  int projections = 3;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named = name_policy("direct", {{"most_rows", &policy.most_rows},
                                                 {"most_factor_work", &policy.most_factor_work},
                                                 {"aim", &policy.aim},
                                                 {"reduced_share", &policy.reduced_share},
                                                 {"stale_steps", &policy.stale_steps},
                                                 {"projections", &policy.projections}});

}  // namespace amontons::direct
