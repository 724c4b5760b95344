// One outer step of the fixed point on the De Saxce term (Cadoux 2009; Acary, Cadoux, Lemarechal, Malick
// 2011): the term mu |u_t| of the start is frozen, which leaves a convex problem; the interior point solves
// that; and a burst of APGD, which renews the term in every iteration, takes the rest of the change. The
// first-order iterates know what slides long before they know the stresses of a hyperstatic stack, which the
// interior point finds at once: together they do in one step what either needs ten times the work for.
#include <algorithm>
#include <cmath>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/driver/phases.hpp"

namespace amontons {

namespace {

constexpr std::size_t burst = 300;
// The frozen problem is solved to this part of the residual of the start: the term is no better than that.
constexpr double inner_tolerance = 0.02;

// The problem with b_n + mu |u_t|.
Problem with_frozen_term(const Problem& problem, const std::vector<double>& u) {
  Problem frozen = problem;
  for_each_block(problem.K, [&]<class Set>(const Set& set, std::size_t, std::size_t row) {
    double g[Set::dim];
    add_saxce_term(set, Law::coulomb, &u[row], g);
    frozen.b[row] += g[0] - u[row];
  });
  return frozen;
}

}  // namespace

Solution frozen_path(const Problem& problem, const Options& options) {
  Monitor monitor(options, 1, 1);
  std::vector<double> x(problem.rows()), u(problem.rows());
  const double start = starting_point(problem, options, x, u, monitor);
  Options inner = options;
  inner.law = Law::associated;
  inner.x0 = {};
  inner.tolerance = std::max(0.5 * options.tolerance, inner_tolerance * start);
  inner.history = false;  // its residuals are those of another problem
  inner.callback = nullptr;
  inner.deadline = options.deadline - monitor.elapsed();
  Solution convex = central_path(with_frozen_term(problem, u), inner);
  const double time = monitor.elapsed();
  const std::size_t products = convex.products + monitor.products;
  const auto count = [&](IterationRecord record) {
    record.iteration += convex.iterations, record.products += products, record.time += time;
    return record;
  };
  Options outer = options;
  outer.x0 = convex.x;
  outer.max_iterations = burst;
  outer.deadline = options.deadline - time;
  if (options.callback)
    outer.callback = [&](const IterationRecord& record) { return options.callback(count(record)); };
  Solution s = apgd(problem, outer);
  for (IterationRecord& record : s.history) record = count(record);
  s.iterations += convex.iterations, s.products += products, s.factorizations += convex.factorizations;
  s.time += time;
  s.method = "interior-point";
  if (convex.status == Status::interrupted) s.status = convex.status;
  return s;
}

}  // namespace amontons
