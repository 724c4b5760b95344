#pragma once
#include <cstddef>
#include <functional>
#include <limits>
#include <span>

#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

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

}  // namespace amontons
