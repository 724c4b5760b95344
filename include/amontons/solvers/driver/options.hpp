#pragma once
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "amontons/problem/problem.hpp"

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

// Every field: default, unit, sensible range. validate() throws InputError naming the field.
struct SpgOptions {          // Birgin, Martinez, Raydan 2000; Tasora 2013
  double alpha_min = 1e-13;  // > 0, smallest spectral step
  double alpha_max = 1e13;   // > alpha_min
  double sigma_min = 0.1;    // in (0, 1): a backtrack multiplies lambda by at least sigma_min
  double sigma_max = 0.9;    // in [sigma_min, 1): and at most sigma_max
  // N_GLL, at most 1e6: how far the nonmonotone test looks back, max f_{j-i} over i = 0..min(j, N_GLL); at 0
  // the objective falls in every step
  std::size_t memory = 10;
  double gamma = 1e-4;  // in (0, 1), sufficient decrease
  double tau_g = 1e-6;  // > 0, scale of the fallback measure of the literal variant
};
struct SorOptions {
  double omega = 1.0;  // in (0, 2) for Gauss-Seidel; for Jacobi the default 0 means 1 / (Gershgorin bound)
};
struct JacobiOptions {
  double omega = 0.0;  // 0: chosen from a power iteration on P^-1 A; else > 0
};
struct AdmmOptions {
  double rho = 0.0;  // 0: chosen and adapted from the problem; else > 0, scale of the penalty rho P
};

// Options common to all methods.
struct Options {
  Law law = Law::associated;
  double tolerance = 1e-6;                                    // natural residual, >= 0; 0 runs to the limit
  std::size_t max_iterations = 0;                             // 0: the method's own default
  double deadline = std::numeric_limits<double>::infinity();  // s of wall clock, > 0
  std::span<const double> x0 = {};                            // warm start, empty or m entries
  bool history = false;                                       // record every iteration
  unsigned threads = 1;                                       // >= 1; results do not depend on it
  std::function<bool(const IterationRecord&)> callback;       // return true to stop
  std::function<bool()> interrupted;                          // polled every few milliseconds
  SpgOptions spg;
  SorOptions sor;
  JacobiOptions jacobi;
  AdmmOptions admm;
};
void validate(const Options& options, const Problem& problem);

struct Solution {
  std::vector<double> x, u;  // impulses and A x + b (without the De Saxce term), m entries
  Status status = Status::stalled;
  double residual = 0;   // natural, of x under the law asked for, from a fresh product
  double objective = 0;  // 1/2 x'Ax + b'x
  std::size_t iterations = 0, products = 0, factorizations = 0;
  double time = 0;     // s
  std::string method;  // the method that produced x
  std::string reason;  // of "auto": what was picked and why, one sentence; empty for a method asked for
  std::vector<IterationRecord> history;
};

}  // namespace amontons
