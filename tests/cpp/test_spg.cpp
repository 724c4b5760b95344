#include <algorithm>
#include <cmath>
#include <string_view>
#include <vector>

#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;
using small::Case;
using small::Vector;

// The loop of the paper with every vector and every objective kept: objective, alpha and backtracks of each
// iteration under the associated law.
std::vector<IterationRecord> spg_of_the_paper(const Problem& p, const SpgOptions& o, std::size_t iterations) {
  const std::size_t m = p.rows();
  Vector P(m), x(m), f;
  for_each_block(p.K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
    for (int k = 0; k < Set::dim; ++k) P[row + k] = p.P[block];
  });
  const auto gradient = [&](const Vector& at) { return small::velocities(p, at); };
  const auto objective = [&](const Vector& at, const Vector& g) {
    double sum = 0;
    for (std::size_t i = 0; i < m; ++i) sum += 0.5 * at[i] * (g[i] + p.b[i]);
    return sum;
  };
  project(p.K, x, x);
  Vector g = gradient(x);
  f.push_back(objective(x, g));
  double alpha = 1;
  std::vector<IterationRecord> records(1);
  for (std::size_t j = 0; j < iterations; ++j) {
    records[j].objective = f[j], records[j].step = alpha;
    Vector d(m), x_next(m), g_next;
    for (const bool preconditioned : {true, false}) {
      for (std::size_t i = 0; i < m; ++i) d[i] = x[i] - alpha * g[i] / (preconditioned ? P[i] : 1);
      project(p.K, d, d);
      for (std::size_t i = 0; i < m; ++i) d[i] -= x[i];
      if (std::inner_product(d.begin(), d.end(), g.begin(), 0.0) < 0) break;
    }
    const double dg = std::inner_product(d.begin(), d.end(), g.begin(), 0.0);
    double f_max = f[j], f_next = 0, lambda = 1;
    for (std::size_t i = 0; i <= std::min(j, o.memory); ++i) f_max = std::max(f_max, f[j - i]);
    std::size_t backtracks = 0;
    for (;; ++backtracks) {
      for (std::size_t i = 0; i < m; ++i) x_next[i] = x[i] + lambda * d[i];
      g_next = gradient(x_next);
      f_next = objective(x_next, g_next);
      if (f_next <= f_max + o.gamma * lambda * dg) break;
      const double minimum = -lambda * lambda * dg / (2 * (f_next - f[j] - lambda * dg));
      lambda = std::clamp(minimum, o.sigma_min * lambda, o.sigma_max * lambda);
    }
    double sPs = 0, sy = 0, yPy = 0;
    for (std::size_t i = 0; i < m; ++i) {
      const double s = x_next[i] - x[i], y = g_next[i] - g[i];
      sPs += P[i] * s * s, sy += s * y, yPy += y * y / P[i];
    }
    alpha = std::clamp(j % 2 == 1 ? sPs / sy : sy / yPy, o.alpha_min, o.alpha_max);
    x = x_next, g = g_next, f.push_back(f_next);
    records.emplace_back().backtracks = backtracks;
  }
  records.pop_back();
  return records;
}

// Breaks when the literal variant departs from the paper: another window of the nonmonotone test, another
// interpolation, steps that do not alternate or leave their bounds, a trial that costs more than one product.
// Both follow the same iterates until rounding grows, hence the first iterations only.
TEST(literal_spg_takes_the_steps_of_the_paper) {
  std::size_t backtracks = 0, bounded = 0;
  for (const Case& c : {Case{"sliding stack 1:10", small::stack(5, 10, 0.3)},
                        Case{"mechanism", small::mechanism()}, Case{"dense", small::random_mixed(1, false)}})
    for (const std::size_t memory : {0, 1, 2, 10})
      for (const double alpha_max : {1e13, 1.5}) {
        Options options;
        options.law = Law::associated;
        options.history = true;
        options.tolerance = 0;
        options.max_iterations = 25;
        options.spg.memory = memory;
        options.spg.alpha_max = alpha_max;
        const auto found = spg_literal(c.problem, options, small::no_limit).history;
        const auto expected = spg_of_the_paper(c.problem, options.spg, 25);
        double scale = 0;
        for (const IterationRecord& r : expected) scale = std::max(scale, std::abs(r.objective));
        CHECK(found.size() >= expected.size());
        for (std::size_t j = 0; j < std::min(found.size(), expected.size()); ++j) {
          CHECK_NEAR(found[j].objective, expected[j].objective, 1e-7 * scale);
          CHECK_NEAR(found[j].step, expected[j].step, 1e-5 * expected[j].step);
          CHECK(found[j].backtracks == expected[j].backtracks);
          if (j > 0) CHECK(found[j].products == found[j - 1].products + 1 + found[j].backtracks);
          backtracks += expected[j].backtracks;
          bounded += expected[j].step == 1.5;
        }
      }
  CHECK(backtracks > 10 && bounded > 10);  // else nothing was tested
}

// The accepted objective is below max f_{j-i}, i = 0..min(j, N_GLL), and N_GLL + 1 values are needed for
// that: somewhere it is above the last N_GLL of them. Breaks when the window is one value shorter or longer,
// in the literal or the production variant, and when N_GLL = 0 is not monotone.
TEST(nonmonotone_window_is_that_of_the_paper) {
  const Problem p = small::stack(5, 10, 0.3);
  for (std::string_view method : {"p-spg-fb", "p-spg-fb-literal"})
    for (const std::size_t memory : {0, 1, 2}) {
      Options options;
      options.law = Law::associated;
      options.history = true;
      options.tolerance = 1e-4;
      options.max_iterations = 2000;
      options.spg.memory = memory;
      const auto history = solve(p, method, options).history;
      double scale = 0;
      for (const IterationRecord& r : history) scale = std::max(scale, std::abs(r.objective));
      std::size_t above_shorter_window = 0;
      for (std::size_t j = 0; j + 1 < history.size(); ++j) {
        double highest = history[j].objective, shorter = -INFINITY;
        for (std::size_t i = 0; i <= std::min(j, memory); ++i) {
          highest = std::max(highest, history[j - i].objective);
          if (i < memory) shorter = std::max(shorter, history[j - i].objective);
        }
        CHECK(history[j + 1].objective <= highest + 1e-12 * scale);
        above_shorter_window += j >= memory && history[j + 1].objective > shorter + 1e-9 * scale;
      }
      CHECK(above_shorter_window > 0);
    }
}

// On bilateral problems P-SPG-FB is near the Krylov methods at loose tolerances: within four times the
// products of CG. Breaks when the Barzilai-Borwein steps stop alternating, or lose the preconditioner.
TEST(spg_is_near_krylov_on_bilateral_problems) {
  const Problem p = small::chain(60, true);
  Options options;
  options.law = Law::associated;
  options.tolerance = 1e-3;
  const Solution krylov = cg(p, options, small::no_limit);
  for (std::string_view method : {"p-spg-fb", "p-spg-fb-literal"}) {
    const Solution s = solve(p, method, options);
    CHECK(s.status == Status::converged);
    CHECK(s.products <= 4 * krylov.products);
  }
}
