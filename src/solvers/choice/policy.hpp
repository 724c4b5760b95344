// Every tuned number of `auto`, with its unit, its reason, and the benchmark that protects it.
// tools/check_policy.py finds numbers elsewhere. They decide when a first-order method gives way, and in
// which order others follow; docs/decisions/auto.md tells what was measured.
#pragma once
#include <cstddef>

#include "amontons/base/policy.hpp"

namespace amontons::choice {

struct Policy {
  // Sizes that are factored.

  // Size (rows): a larger matrix is not factored; a dense one takes 72 MB. A larger bilateral system goes to
  // conjugate gradients first: its elimination takes 12 ms for 3500 rows (B1).
  std::size_t most_rows = 3000;
  // Size (bodies): with more bodies nothing is factored; the analysis takes seconds.
  std::size_t most_bodies = 50000;

  // The order.

  // Iterations (count): after which the rate of a first-order method is measured, and again. Newton's method
  // finds the faces within as many or fails.
  std::size_t first_turn = 16;
  // Progress (log of the residual): assumed at least for half of a method's work, because early rates say
  // little. Without it 1000 spheres in a box (benchmarks/corpus.py) take 50 times the work.
  double least_progress = 0.05;
  // Factorisations (count): expected of the interior point. Twice as many under coulomb, as with half of that
  // walls and spheres in a box take up to eight times the work: first-order iterations end too early.
  double path_factorizations = 11;
  // Work (units per block): of assembling a factorisation and of a method's work on its cones. With 11 or 44
  // the work of walls of 192 bricks changes by a tenth.
  double assembly = 22;
  // Size (blocks): with more of them the path with the De Saxce term held comes first. Without it walls take
  // three times the work, and with it everywhere FCLIB files take twice as much.
  std::size_t many_blocks = 800;

  // Islands.

  // Size (blocks): smaller islands are solved together, because the set-up of a solve takes microseconds, as
  // long as some iterations on so few blocks.
  std::size_t small_island = 64;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
inline constinit Policy policy;
inline const bool named = name_policy("choice", {{"most_rows", &policy.most_rows},
                                                 {"most_bodies", &policy.most_bodies},
                                                 {"path_factorizations", &policy.path_factorizations},
                                                 {"many_blocks", &policy.many_blocks},
                                                 {"least_progress", &policy.least_progress},
                                                 {"assembly", &policy.assembly},
                                                 {"first_turn", &policy.first_turn},
                                                 {"small_island", &policy.small_island}});

}  // namespace amontons::choice
