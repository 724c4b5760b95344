// Every tuned number of `auto`, with its unit, its reason, and the benchmark that protects it.
// tools/check_policy.py finds numbers elsewhere. Costs and expectations are medians over the tuning half of
// benchmarks/corpus.py. They decide which method begins; the measured rate of each method decides the rest.
#pragma once
#include <cstddef>

namespace amontons::choice {

struct Policy {
  // Cost of a product fused with the passes of a first-order method.

  // Time (ns per contact): of the vectorised passes.
  double product_per_contact = 9;
  // Time (ns per contact): of the plain loops, for problems that the vectorised passes do not support.
  double plain_per_contact = 44;
  // Time (ns per row): of rows that do not belong to contacts.
  double product_per_row = 5;
  // Time (products): of a separate product, which reads the contacts once more.
  double unfused = 2.5;
  // Time (products): mean of a solve with the factor and a separate product.
  double factor_solve = 12;

  // Cost of a factorisation.

  // Time (ns per body): of the assembly of rows and columns.
  double factor_per_body = 90;
  // Time (ns per block): of scaling and assembling a block and of the method's work on its cone.
  double factor_per_block = 450;
  // Time (ns per multiplication): of the dense kernels.
  double factor_per_multiplication = 0.25;
  // Size (rows): a larger matrix is not factored; a dense one takes 200 MB.
  std::size_t most_rows = 5000;
  // Size (bodies): with more bodies nothing is factored; the analysis takes seconds.
  std::size_t most_bodies = 50000;

  // Expectations: linear systems.

  // Size (rows): for more, conjugate gradients precede elimination, which takes 12 ms for 3500 rows (B1).
  std::size_t large_linear_system = 3000;

  // Products (count): of conjugate gradients to reach the tolerance, with a factorisation or without.
  double linear_products = 8;
  // Factorisations (count): of preconditioned conjugate gradients; the analysis costs more than one.
  double preconditioned_factorizations = 2.5;
  // Products (count): before contradictory rows are suspected; solvable ones need fewer.
  double contradiction_products = 5000;
  // Iterations (count): in which p-spg-fb diverges along a contradiction and so proves it.
  std::size_t contradiction_iterations = 200;

  // Expectations: friction and inequalities.

  // Products (count): of the more likely first-order method.
  double likelier_products = 30;
  // Products (count): of the less likely one.
  double unlikelier_products = 100;
  // Size (contacts): from here on apgd is the more likely one. With hundreds of contacts it is five times
  // faster in the mean; p-spg-fb is faster with few contacts, and on joints.
  std::size_t many_contacts = 30;
  // Iterations (count): of the first turn, enough to show a rate.
  std::size_t first_turn = 16;
  // Time (ns per body and product): of bodies with eliminated joints.
  double product_per_held_body = 300;
  // Factorisations (count): of the interior point before its first digit, and of Newton's method from the end
  // of its path.
  double path_start = 4;
  // Factorisations (count per digit): of the interior point.
  double path_per_digit = 1.1;
  // Factorisations (ratio): cost under coulomb, where the matrix is unsymmetric.
  double path_unsymmetric = 1.7;
  // Factorisations (ratio): of all paths with the De Saxce term held, relative to one under the associated
  // law.
  double frozen_ratio = 4;
  // Size (blocks): number that doubles the expectation of methods that must find all faces at once.
  double blocks_unit = 600;
  // Iterations (count): limit within which Newton's method finds the faces or fails.
  std::size_t newton_iterations = 20;

  // Iterations (count): limit of p-spg-fb for the last digits of "interior-point".
  std::size_t last_iterations = 20000;

  // The race.

  // Work (relative): growth of a method's total work by one turn. It bounds the cost of the race to a
  // multiple of the winner's.
  double turn = 0.25;
  // Progress (log of the residual): assumed at least for half of a method's work, 3 % per doubling. A
  // stagnating method gets turns that grow with those of the others.
  double least_progress = 0.03;
  // Work (ns): limit of a race of few blocks if the caller sets none.
  double race_work = 1.6e9;
  // Work (ns per block): addition to this limit; a problem still unsolved then converges too slowly.
  double race_work_per_block = 6e5;
  // Work (ns): limit after the direct way has failed. Most such problems have no solution, and p-spg-fb does
  // not prove this within 2 ms (test_status).
  double late_race_work = 8e6;
  // Work (ns per block): addition to this limit.
  double late_race_work_per_block = 5e4;

  // Islands.

  // Size (blocks or bodies): smaller islands are solved together, because the set-up of a solve takes
  // microseconds, as long as some iterations on so few blocks. The fill of so few bodies is small: their
  // number gives the cost of a factorisation without an analysis.
  std::size_t small_island = 64;

  // Rounds of a path with the De Saxce term held.

  // Residual (relative to that of the start): target of the path. Its solution solves the true problem up to
  // the change of the term, which is of the order of that residual; further digits would be wrong.
  double frozen_tolerance = 0.02;
  // Iterations (count): of apgd after a path, to renew the term.
  std::size_t frozen_burst = 300;
};
// Read by every thread without a lock: only set_policy() (base/policy.hpp) changes it, between runs.
extern Policy policy;

}  // namespace amontons::choice
