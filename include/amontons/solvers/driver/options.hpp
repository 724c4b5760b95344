#pragma once
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "amontons/problem/problem.hpp"
#include "amontons/solvers/driver/solution.hpp"

namespace amontons {

struct IterateSource;  // first_order/forwarded_iterate.hpp

// Each field states its unit, range and the fields that it interacts with. A field without a unit is a pure
// number. validate() throws InputError with the name of the field that is out of range.

// p-spg-fb and its literal variant: Birgin, Martinez, Raydan 2000; Tasora 2013.
struct SpgOptions {
  // Bounds of the spectral step, 0 < alpha_min < alpha_max < inf. In the P metric the step is of order one.
  // The defaults only catch a curvature that vanishes or overflows.
  double alpha_min = 1e-13, alpha_max = 1e13;
  // A backtrack multiplies lambda by a factor in [sigma_min, sigma_max], 0 < sigma_min <= sigma_max < 1.
  double sigma_min = 0.1, sigma_max = 0.9;
  // N_GLL, 0 to 1e6: length of the nonmonotone line search of Grippo, Lampariello, Lucidi, max f_{j-i} over i
  // = 0 .. min(j, N_GLL). At 0 the objective falls in every step, which costs many small steps.
  std::size_t memory = 10;
  // In (0, 1): a step must lower the objective below that maximum by gamma lambda <d, g> (Armijo).
  double gamma = 1e-4;
  // kg, > 0: scale of the measure |Pi_K(x - tau_g g) - x| / tau_g of the fallback. Only the literal variant
  // uses it; spg() measures by the residual.
  double tau_g = 1e-6;
};

// gauss-seidel only.
struct SorOptions {
  // In (0, 2); the sweep diverges beyond. 1 is Gauss-Seidel, above 1 is over-relaxation.
  double omega = 1.0;
};

// jacobi only.
struct JacobiOptions {
  // >= 0; 0 takes 1 / lambda_max(P^-1 A), estimated by power iterations. Diverges beyond twice that value.
  double omega = 0.0;
};

// Options common to all methods.
struct Options {
  // The law of friction; by default that of the problem. The two laws agree for sets without friction.
  std::optional<Law> law = {};
  // Tolerance of the natural residual, >= 0. The residual is 1 at x = 0, or 0 if x = 0 is the solution. 0
  // runs to the limits.
  double tolerance = 1e-6;
  // 0 leaves every method its own limit. A given number is the limit of all phases of `auto` together, for
  // each group of islands separately. The cost of an iteration differs between methods.
  std::size_t max_iterations = 0;
  // Wall-clock time of a whole solve (s), > 0, of which solve() makes the budget: methods read only that.
  // Results depend on the clock only if it is finite.
  double deadline = std::numeric_limits<double>::infinity();
  // Warm start: empty, or m finite entries, which must outlive the solve. It is projected on K, and used only
  // if its residual is at most three times that of 0. The interior point starts from the middle of its cones
  // regardless.
  std::span<const double> x0 = {};
  // Record every iteration in Solution::history. This costs the objective in every iteration. `auto` then
  // keeps islands together and bilateral rows in the problem, so that there is one sequence of iterations to
  // record.
  bool history = false;
  // Threads of the fused passes of p-spg-fb and apgd on a ContactSystem; 0: one per core, if the problem is
  // large enough. Results never depend on it.
  unsigned threads = 0;
  // Source of the iterates of p-spg-fb and apgd, for example a device; null: this library. Other methods
  // ignore it. auto uses one of the two for a problem that the source serves.
  std::shared_ptr<IterateSource> iterates = {};
  // Called once per iteration if not empty; true stops with Status::interrupted. It costs as much as history.
  std::function<bool(const IterationRecord&)> callback;
  // If not empty, called between iterations and within factorisations, at most every 20 ms; true stops with
  // Status::interrupted. solve() makes an Interrupt of it (base/interrupt.hpp); methods ask only that.
  std::function<bool()> interrupted;
  SpgOptions spg;
  SorOptions sor;
  JacobiOptions jacobi;
};

// The law of a solve.
inline Law law_of(const Problem& problem, const Options& options) {
  return options.law.value_or(problem.law);
}

// InputError for a field out of range or an x0 that does not fit the problem.
void validate(const Options& options, const Problem& problem);

}  // namespace amontons
