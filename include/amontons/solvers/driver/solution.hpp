#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace amontons {

enum class Status : unsigned char {
  converged,        // the residual of the returned x is at or below the tolerance
  iteration_limit,  // max_iterations reached; x is the best iterate seen
  deadline,         // the wall-clock deadline passed; x is the best iterate seen
  stalled,          // the method can make no further progress (rounding, or no descent); x is the best seen
  interrupted,      // the callback or Ctrl-C asked to stop; x is the best iterate seen
  infeasible,       // a certificate d in K with A d = 0, b'd < 0 was found: no velocity satisfies the
                    // constraints, impulses grow without bound; x is the best iterate seen
};

struct IterationRecord {
  std::size_t iteration, products;
  double time;           // s since the start of the solve
  double residual;       // natural, of the current iterate
  double best_residual;  // of the fallback iterate
  double objective;      // 1/2 x'Ax + b'x of the current iterate (of the frozen correction under coulomb)
  double step;           // alpha of the spectral step, rho of ADMM, step length of a Newton method; 0 if none
  std::size_t backtracks;
};

// One phase of a solve that took several: a row of its table that ran.
struct PhaseRecord {
  std::string method;  // and what it was run on, where that is not the problem itself
  std::string why;     // the reason that the table gives
  std::size_t iterations;
  double residual;  // natural, of what it ended with
};

struct Solution {
  std::vector<double> x, u;  // impulses and A x + b (without the De Saxce term), m entries
  Status status = Status::stalled;
  double residual = 0;   // natural, of x under the law asked for, from a fresh product
  double objective = 0;  // 1/2 x'Ax + b'x
  std::size_t iterations = 0, products = 0, factorizations = 0;
  double time = 0;                  // s
  std::string method;               // the method that made x
  std::string reason;               // what was chosen and why, and which phases ran; empty if one method did
  std::vector<PhaseRecord> phases;  // of a solve with several, in the order in which they ran
  std::vector<IterationRecord> history;
};

}  // namespace amontons
