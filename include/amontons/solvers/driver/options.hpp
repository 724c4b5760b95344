#pragma once
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <span>

#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

struct IterateSource;  // first_order/forwarded_iterate.hpp

// Each field says its unit, range and what it interacts with; without a unit it is a pure number.
// validate() throws InputError with the name of the field that is out of range.

// p-spg-fb and its literal variant: Birgin, Martinez, Raydan 2000; Tasora 2013.
struct SpgOptions {
  // Bounds of the spectral step, 0 < alpha_min < alpha_max < inf. In the P metric the step is of order one,
  // so that the defaults only catch a curvature that vanishes or overflows.
  double alpha_min = 1e-13, alpha_max = 1e13;
  // A backtrack multiplies lambda by a factor in [sigma_min, sigma_max], 0 < sigma_min <= sigma_max < 1.
  double sigma_min = 0.1, sigma_max = 0.9;
  // N_GLL, 0 to 1e6: how far the nonmonotone test of Grippo, Lampariello, Lucidi looks back, max f_{j-i} over
  // i = 0 .. min(j, N_GLL); at 0 the objective falls in every step, which costs many small steps.
  std::size_t memory = 10;
  // In (0, 1): a step must bring the objective below that maximum by gamma lambda <d, g> (Armijo).
  double gamma = 1e-4;
  // kg, > 0: scale of the measure |Pi_K(x - tau_g g) - x| / tau_g of the fallback; literal variant only, the
  // production form measures by the residual.
  double tau_g = 1e-6;
};

// gauss-seidel only.
struct SorOptions {
  // In (0, 2), beyond which the sweep diverges; 1 is Gauss-Seidel, above it is over-relaxation.
  double omega = 1.0;
};

// jacobi only.
struct JacobiOptions {
  // >= 0; 0 takes 1 / lambda_max(P^-1 A), estimated by power iterations. Diverges beyond twice that.
  double omega = 0.0;
};

// admm only.
struct AdmmOptions {
  // >= 0, of the penalty rho P. 0 starts from a default and adapts it to the balance of the residuals; a
  // given value stays, which saves the factorisations of the adaptation.
  double rho = 0.0;
};

// Options common to all methods.
// s: stands for none that is left, as a deadline is above zero.
inline constexpr double least_deadline = 1e-9;

struct Options {
  // The law of friction; the two agree for cones without friction.
  Law law = Law::associated;
  // Of the natural residual, which is 1 at x = 0 (or 0 if that is the solution); >= 0. 0 runs to the limits.
  double tolerance = 1e-6;
  // 0 leaves every method its own limit. A given number counts for the whole of `auto`, over all its phases,
  // but for each group of islands by itself; what an iteration costs differs between methods.
  std::size_t max_iterations = 0;
  // s of wall clock, > 0, for the whole of a solve. Results depend on the clock only where it is finite.
  double deadline = std::numeric_limits<double>::infinity();
  // Warm start: empty, or m finite entries, which must outlive the solve. Projected on K, and used only if
  // its residual is at most three times that of 0. The interior point starts from the middle of its cones all
  // the same.
  std::span<const double> x0 = {};
  // Record every iteration in Solution::history. Costs the objective in every iteration; `auto` then keeps
  // islands together and bilateral rows in the problem, so that there is one iteration to be watched.
  bool history = false;
  // Workers of the fused passes of p-spg-fb and apgd on a ContactSystem; 0: one per core, where the problem
  // is large enough. Results never depend on it.
  unsigned threads = 0;
  // Where p-spg-fb and apgd take their iterates from, a device for instance; null: this library. Other
  // methods ignore it, and auto takes one of the two for a problem that it serves.
  std::shared_ptr<IterateSource> iterates;
  // Called once per iteration if not empty; true stops with Status::interrupted. Costs what history costs.
  std::function<bool(const IterationRecord&)> callback;
  // Asked between iterations and within factorisations, at most every 20 ms, if not empty; true stops with
  // Status::interrupted. solve() asks it, through a Patience (base/patience.hpp); whoever calls a method
  // itself makes one.
  std::function<bool()> interrupted;
  SpgOptions spg;
  SorOptions sor;
  JacobiOptions jacobi;
  AdmmOptions admm;
};

// InputError for a field out of range or an x0 that does not fit the problem.
void validate(const Options& options, const Problem& problem);

}  // namespace amontons
