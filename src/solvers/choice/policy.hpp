// Every tuned number of `auto`, with its unit, its reason, and the benchmark that protects it.
// tools/check_policy.py finds numbers elsewhere. Costs are medians over the tuning half of
// benchmarks/corpus.py; expectations were chosen over its FCLIB and Chrono files. They decide which method
// begins. The measured rate of each method decides the rest.
#pragma once
#include <cstddef>

namespace amontons::choice {

struct Policy {
  // Cost of products and factorisations.

  // Time (ns per row): of a product and the passes of a first-order method over its result.
  double product_per_row = 3;
  // Time (ns per body and product): of bodies with eliminated joints. Without it the race for a small wall
  // under a hanging ball takes a quarter more products.
  double product_per_held_body = 300;
  // Time (ns per block): of scaling and assembling a block and of the method's work on its cone.
  double factor_per_block = 450;
  // Time (ns per multiplication): of the dense kernels.
  double factor_per_multiplication = 0.25;
  // Size (rows): a larger matrix is not factored; a dense one takes 72 MB. A larger bilateral system goes to
  // conjugate gradients first: its elimination takes 12 ms for 3500 rows (B1).
  std::size_t most_rows = 3000;
  // Size (bodies): with more bodies nothing is factored; the analysis takes seconds.
  std::size_t most_bodies = 50000;

  // Expectations.

  // Factorisations (count): of the interior point under the associated law.
  double path_factorizations = 11;
  // Factorisations (ratio): cost under coulomb, where the matrix is unsymmetric.
  double path_unsymmetric = 1.7;
  // Factorisations (ratio): of all paths with the De Saxce term held, relative to one under the associated
  // law.
  double frozen_ratio = 4;
  // Size (blocks): number that doubles the expectation of methods that must find all faces at once, and the
  // limits of work.
  double blocks_unit = 600;

  // The race.

  // Iterations (count): of the first turn of a first-order method, enough to show a rate. Newton's method
  // finds the faces within as many or fails.
  std::size_t first_turn = 16;
  // Work (relative): growth of a method's total work by one turn. It bounds the cost of the race to a
  // multiple of the winner's. Progress (log of the residual): assumed at least for half of a method's work. A
  // stagnating method gets turns that grow with those of the others.
  double turn = 0.05;
  // Work (ns): limit of a race of few blocks if the caller sets none. A problem still unsolved then converges
  // too slowly.
  double race_work = 4e8;
  // Work (ns): this limit after the direct way has failed. Most such problems have no solution, which takes
  // more than 2 ms to prove (test_status).
  double late_race_work = 8e6;

  // Islands.

  // Size (blocks or bodies): smaller islands are solved together, because the set-up of a solve takes
  // microseconds, as long as some iterations on so few blocks. The fill of so few bodies is small: their
  // number gives the cost of a factorisation without an analysis.
  std::size_t small_island = 64;

  // Rounds of a path with the De Saxce term held.

  // Residual (relative to that of the start): target of the path. Its solution solves the true problem up to
  // the change of the term, which is of the order of that residual; further digits would be wrong.
  double frozen_tolerance = 0.02;
  // Iterations (count): of apgd after a path, to renew the term. With 100 a wall at rest (B4_s60) stalls.
  std::size_t frozen_burst = 300;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
extern Policy policy;

}  // namespace amontons::choice
