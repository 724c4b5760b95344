#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "method_case.hpp"
#include "problems.hpp"

using namespace amontons;
using namespace method_case;
using small::Case;

// The records of a solve are those of the solve: numbered, in order, with best_residual the running minimum.
// Breaks when a phase of a method starts its count or its clock anew, records an iteration twice, or when
// what is returned is not the best that was recorded.
TEST(history_is_consistent) {
  for (const Case& c : {Case{"mechanism", small::mechanism()}, Case{"chain", small::chain(8)}})
    for (std::string_view method : method_names())
      for (Law law : laws) {
        if (is_linear_only(method) && !c.problem.K.all_bilateral()) continue;
        Options options;
        options.law = law;
        options.history = true;
        options.tolerance = 1e-5;
        std::vector<double> seen;
        options.callback = [&](const IterationRecord& record) {
          seen.push_back(record.residual);
          return false;
        };
        const Solution s = solve(c.problem, method, options);
        EXPECT(!s.history.empty());
        if (s.history.empty()) continue;
        double best = INFINITY;
        for (std::size_t i = 0; i < s.history.size(); ++i) {
          const IterationRecord& r = s.history[i];
          best = std::min(best, r.residual);
          EXPECT(r.best_residual == best);
          EXPECT(r.products <= s.products && r.time <= s.time);
          if (i == 0) continue;
          const IterationRecord& before = s.history[i - 1];
          EXPECT(r.products >= before.products && r.time >= before.time);
          // A last step that found no way counts, but leaves no record: others go on after it.
          EXPECT(r.iteration == before.iteration + 1 || r.iteration == before.iteration ||
                 (method == "auto" && r.iteration == before.iteration + 2));
        }
        EXPECT(s.history.front().iteration == 0);
        EXPECT(s.history.back().iteration == s.iterations);
        EXPECT(std::abs(s.history.back().best_residual - s.residual) <= 1e-3 * options.tolerance);
        // The callback sees the same, but for a last record that ends the solve before it is asked.
        EXPECT(seen.size() <= s.history.size());
        for (std::size_t i = 0; i < std::min(seen.size(), s.history.size()); ++i)
          if (!one_of(method, {"auto", "interior-point"})) EXPECT(seen[i] == s.history[i].residual);
        if (!one_of(method, {"auto", "interior-point"})) EXPECT(s.history.size() == s.iterations + 1);
      }
}

// Who watches changes nothing: products, iterations and bits are the same. Breaks when a method works for the
// history what it would not have worked anyway, as minres once did for the objective. `auto` is watched on
// the whole problem, where it would otherwise eliminate and split it: Options::history says so.
TEST(history_costs_no_products) {
  for (const Case& c : {Case{"mechanism", small::mechanism()}, Case{"chain", small::chain(8)}})
    for (std::string_view method : method_names()) {
      if (method == "auto") continue;
      if (is_linear_only(method) && !c.problem.K.all_bilateral()) continue;
      const Law law = Law::coulomb;
      Options options;
      options.law = law;
      const Solution plain = solve(c.problem, method, options);
      options.history = true;
      const Solution watched = solve(c.problem, method, options);
      EXPECT(watched.products == plain.products && watched.iterations == plain.iterations);
      EXPECT(watched.x == plain.x);
    }
}

// The objective in the history of the Krylov methods is that of the iterate, which a solve that is stopped
// there returns and evaluates by a product. Breaks when the u that a recurrence carries is not A x + b.
TEST(objective_of_krylov_history_is_that_of_the_iterate) {
  const Case c{"chain", small::chain(8)};
  const Law law = Law::associated;
  for (std::string_view method : {"cg", "minres"}) {
    Options options;
    options.law = Law::associated;
    options.history = true;
    options.tolerance = 1e-10;
    for (const IterationRecord& r : solve(c.problem, method, options).history) {
      if (r.iteration == 0 || r.residual > r.best_residual) continue;
      Options stopped;
      stopped.tolerance = 0;
      stopped.max_iterations = r.iteration;
      const Solution s = solve(c.problem, method, stopped);
      EXPECT(std::abs(s.objective - r.objective) <= 1e-9 * std::abs(s.objective));
    }
  }
}

// A manipulator whose joints contradict each other drives cg beyond the largest number. Breaks when that is
// told as a fault of A, which ends the simulation, and when negative curvature no longer is.
TEST(overflow_is_no_negative_curvature) {
  require_curvature(NAN, INFINITY);
  require_curvature(-1e-6, 1);
  CHECK_THROWS(require_curvature(-1e-4, 1), "not positive semidefinite");
}
