#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace amontons {

// How a solve ended. Whatever it says, x is the best iterate seen and `residual` its true residual.
enum class Status : unsigned char {
  // The residual of the returned x is at or below the tolerance, whatever stopped the method.
  converged,
  // max_iterations of the caller was reached, or the limit of a method that was called by its name.
  iteration_limit,
  // The wall-clock deadline passed. The clock is looked at between iterations.
  deadline,
  // No further progress is possible: no step was found, the best residual did not fall by 1 % within the
  // stall window, the iterate is no longer finite, or all methods of several came to their end.
  stalled,
  // The callback returned true, or the poll of `interrupted` (Ctrl-C in Python) did.
  interrupted,
  // A certificate was found: d in the recession cone of K with A d = 0 and <b, d> < 0. No velocity satisfies
  // the constraints, and impulses grow without bound along d. Sought after `stalled` and `iteration_limit`.
  infeasible,
  // Steps of a simulation only: the solve converged, and the safe step changed its impulses (Report::path).
  made_safe,
};

// One look of the driver at the iterate; the history is a list of these, and a callback gets each.
struct IterationRecord {
  // 0 for the starting point.
  std::size_t iteration;
  // Products with A so far, or work worth one.
  std::size_t products;
  // s since the start of the solve.
  double time;
  // Natural, of the current iterate. A method that carries u along may be off by the rounding of its sums.
  double residual;
  // The smallest so far: that of the iterate which comes back, except from the literal variant.
  double best_residual;
  // 1/2 x'Ax + b'x of the current iterate (J). The two p-spg-fb sum its changes, each with the De Saxce term
  // held constant: under coulomb that is no function of x.
  double objective;
  // alpha of the spectral step, 1/L of apgd, omega of the relaxations, rho of ADMM; 0 where there is none.
  double step;
  // Trial points that the line search of this iteration refused.
  std::size_t backtracks;
};

// One phase of a solve that took several: a row of its table that ran.
struct PhaseRecord {
  // The method, and what it was run on where that is not the problem itself.
  std::string method;
  // The reason that the row gives.
  std::string why;
  std::size_t iterations;
  // Natural, of what the phase returned, under the law asked for.
  double residual;
};

struct Solution {
  // Impulses (N s) and u = A x + b (m/s) without the De Saxce term, m entries each.
  std::vector<double> x, u;
  Status status = Status::stalled;
  // Natural, of x under the law asked for, from a fresh product: what status and tolerance are about.
  double residual = 0;
  // 1/2 x'Ax + b'x (J), from the same product.
  double objective = 0;
  // Sums over all phases and islands.
  std::size_t iterations = 0, products = 0, factorizations = 0;
  // s of wall clock.
  double time = 0;
  // The method that made x; with islands, the one that made the x of the hardest.
  std::string method;
  // Where its iterates were: "cpu", or the name of Options::iterates.
  std::string device = "cpu";
  // What was chosen and why, and every phase that ran, printed from `phases`. Both are empty for a method
  // that is none of several: all but auto and interior-point.
  std::string reason;
  // The rows that ran, in order; with islands, those of the hardest.
  std::vector<PhaseRecord> phases;
  // Empty unless options.history.
  std::vector<IterationRecord> history;
};

}  // namespace amontons
