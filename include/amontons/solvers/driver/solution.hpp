#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace amontons {

// How a solve ended. In every case x is the best iterate seen and `residual` its true residual.
enum class Status : unsigned char {
  // The residual of the returned x is at or below the tolerance, whatever stopped the method.
  converged,
  // max_iterations of the caller was reached, or the limit of a method that was called by its name.
  iteration_limit,
  // The wall-clock deadline passed. The clock is read between iterations.
  deadline,
  // No further progress is possible. Causes: no step was found, the best residual did not fall by 1 % within
  // the stall window, the iterate is not finite, or all methods ended.
  stalled,
  // The callback returned true, or the poll of `interrupted` (Ctrl-C in Python) did.
  interrupted,
  // A certificate was found: d in the recession cone of K with A d = 0 and <b, d> < 0. No velocity satisfies
  // the constraints, and impulses grow without bound along d. It is sought after `stalled` and
  // `iteration_limit`.
  infeasible,
  // Only for steps of a simulation: the solve converged, and the safe step changed its impulses
  // (Report::path).
  made_safe,
};

// One iteration as the driver saw it. The history is a list of these, and a callback receives each.
struct IterationRecord {
  // 0 for the starting point.
  std::size_t iteration;
  // Products with A so far; other work is counted as the equivalent number of products.
  std::size_t products;
  // s since the start of the solve.
  double time;
  // Natural residual of the current iterate. A method that updates u may differ by the accumulated rounding.
  double residual;
  // The smallest residual so far. Except in the literal variant it is that of the returned x.
  double best_residual;
  // 1/2 x'Ax + b'x of the current iterate (J). The two p-spg-fb sum its changes, each with the De Saxce term
  // held constant. Under coulomb this sum is not a function of x.
  double objective;
  // alpha of the spectral step, 1/L of apgd, omega of the relaxations; 0 where there is none.
  double step;
  // Trial points that the line search of this iteration rejected.
  std::size_t backtracks;
};

// One phase of a solve that took several: a row of its table that ran.
struct PhaseRecord {
  // The method, and the reduced problem that it ran on, if any.
  std::string method;
  // The reason given in the row.
  std::string why;
  std::size_t iterations;
  // Natural residual of the x that the phase returned, under the law asked for.
  double residual;
};

struct Solution {
  // Impulses (N s) and u = A x + b (m/s) without the De Saxce term, m entries each.
  std::vector<double> x, u;
  Status status = Status::stalled;
  // Natural residual of x under the law asked for, from a fresh product. Status and tolerance refer to it.
  double residual = 0;
  // 1/2 x'Ax + b'x (J), from the same product.
  double objective = 0;
  // Sums over all phases and islands.
  std::size_t iterations = 0, products = 0, factorizations = 0;
  // Nominal work (units of Budget) of a whole solve: counted, so that it depends on no clock.
  double work = 0;
  // Wall-clock time (s).
  double time = 0;
  // The method that made x; with islands, that of the hardest island.
  std::string method;
  // Place of its iterates: "cpu", or the name of Options::iterates.
  std::string device = "cpu";
  // The choice with its reason and every phase that ran, printed from `phases`. Both are empty for single
  // methods, that is for all but auto and interior-point.
  std::string reason;
  // The rows that ran, in order; with islands, those of the hardest.
  std::vector<PhaseRecord> phases;
  // Empty unless options.history.
  std::vector<IterationRecord> history;
};

}  // namespace amontons
