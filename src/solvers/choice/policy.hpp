// Every tuned number of `auto`, with its unit, its reason, and the benchmark that protects it.
// tools/check_policy.py finds numbers elsewhere. Costs and expectations are medians over the tuning half of
// benchmarks/corpus.py. They decide who begins; the rate that a method shows decides the rest.
#pragma once
#include <cstddef>

namespace amontons::choice {

// Cost of a product fused with the passes of a first-order method.

// Time (ns): of any, before the first contact.
inline constexpr double product_setup = 160;
// Time (ns per contact): of the vectorised passes.
inline constexpr double product_per_contact = 9;
// Time (ns per contact): of the plain loops, for problems that the vectorised passes do not take.
inline constexpr double plain_per_contact = 44;
// Time (ns per row): of rows that are not of contacts.
inline constexpr double product_per_row = 5;
// Time (products): of a product by itself, which reads the contacts once more.
inline constexpr double unfused = 2.5;
// Time (products): of a solve with the factor and a product by itself, their mean.
inline constexpr double factor_solve = 12;

// Cost of a factorisation.

// Time (ns per body): rows and columns are assembled.
inline constexpr double factor_per_body = 90;
// Time (ns per block): blocks are scaled and assembled, and the method works on their cones.
inline constexpr double factor_per_block = 450;
// Time (ns per multiplication): of the dense kernels.
inline constexpr double factor_per_multiplication = 0.25;
// Size (bodies): fewer fill so little that their number tells the cost without an analysis.
inline constexpr std::size_t few_bodies = 64;
// Size (rows): more of a matrix are not factored; dense they take 200 MB.
inline constexpr std::size_t most_rows = 5000;
// Size (bodies): more are not factored; their analysis takes seconds.
inline constexpr std::size_t most_bodies = 50000;

// Expectations: linear systems.

// Size (rows): beyond it conjugate gradients go before elimination, which takes 12 ms for 3500 rows (B1).
inline constexpr std::size_t large_linear_system = 3000;

// Products (count): of conjugate gradients to the tolerance.
inline constexpr double linear_products = 8;
// Products (count): of conjugate gradients with one factorisation as preconditioner.
inline constexpr double preconditioned_products = 6;
// Factorisations (count): of these; the analysis costs more than one.
inline constexpr double preconditioned_factorizations = 2.5;
// Products (count): after which contradictory rows are looked for; solvable ones need fewer.
inline constexpr double contradiction_products = 5000;
// Iterations (count): in which p-spg-fb runs off along a contradiction and so proves it.
inline constexpr std::size_t contradiction_iterations = 200;

// Expectations: friction and inequalities.

// Products (count): of the first-order method that is the likelier one.
inline constexpr double likelier_products = 30;
// Products (count): of the other one.
inline constexpr double unlikelier_products = 100;
// Size (contacts): from here on apgd is the likelier one, five times faster in the mean over hundreds of
// contacts; p-spg-fb is on few, and on joints.
inline constexpr std::size_t many_contacts = 30;
// Iterations (count): of a first turn, enough to show a rate.
inline constexpr std::size_t first_turn = 16;
// Time (ns per body and product): of bodies whose joints are eliminated.
inline constexpr double product_per_held_body = 300;
// Factorisations (count): of the interior point to no digit.
inline constexpr double path_start = 4;
// Factorisations (count per digit): of the interior point.
inline constexpr double path_per_digit = 1.1;
// Factorisations (ratio): under coulomb they lack symmetry.
inline constexpr double path_unsymmetric = 1.7;
// Factorisations (ratio): of paths with the De Saxce term held, to those of one under the associated law.
inline constexpr double frozen_ratio = 4;
// Size (blocks): that doubles the expectations of methods that have to find all faces at once.
inline constexpr double blocks_unit = 600;
// Factorisations (count): of Newton's method from the end of a path.
inline constexpr double newton_factorizations = 4;
// Iterations (count): after which Newton's method has not found the faces.
inline constexpr std::size_t newton_iterations = 20;

// The race.

// Work (relative): that a turn adds to what the method has done, so that the race costs at most a multiple of
// its winner.
inline constexpr double turn = 0.25;
// Progress (log of the residual): the least that half of the work of a method is taken for, 3 % in a
// doubling; a method that stands still gets turns that grow with those of the others.
inline constexpr double least_progress = 0.03;
// Cost (relative to what was expected): what a factoring method is taken to need at least, as it gains most
// at the end.
inline constexpr double least_left = 0.1;
// Work (relative to all that the method has done): over which its rate is seen, at least.
inline constexpr double least_window = 0.3;
// Work (ns): of a race of few blocks without limits of the caller.
inline constexpr double race_work = 1.6e9;
// Work (ns per block): of the same; what is not solved by then creeps.
inline constexpr double race_work_per_block = 6e5;
// Work (ns): after the direct way has failed; most such problems have no
// solution, which p-spg-fb has not proven within 2 ms (test_status).
inline constexpr double late_race_work = 8e6;
// Work (ns per block): of the same.
inline constexpr double late_race_work_per_block = 5e4;

// Islands.

// Size (blocks): smaller islands are solved together, as a solve takes microseconds to set up, as long as
// some iterations on so few blocks.
inline constexpr std::size_t small_island = 64;

// Rounds of a path with the De Saxce term held.

// Rounds (count): none needed more.
inline constexpr std::size_t frozen_rounds = 20;
// Residual (relative to that of the start): what the path is asked for. Its solution solves the true problem
// up to the change of the term, which is of the order of that residual; further digits would be wrong ones.
inline constexpr double frozen_tolerance = 0.02;
// Iterations (count): most of a path.
inline constexpr std::size_t frozen_path_iterations = 30;
// Iterations (count): of apgd after it, which renew the term.
inline constexpr std::size_t frozen_burst = 300;
// Residual (factor): a round that gains less was poor, and a second poor one ends the rounds.
inline constexpr double frozen_worth = 0.7;

}  // namespace amontons::choice
