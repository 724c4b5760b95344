#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numeric>
#include <string>
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "kkt.hpp"
#include "problems.hpp"

using namespace amontons;
using small::Case;
using small::Vector;

namespace {

constexpr Law laws[] = {Law::associated, Law::coulomb};

bool one_of(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_linear_only(std::string_view method) { return one_of(method, {"cg", "minres"}); }
bool is_factored(std::string_view method) {
  return one_of(method, {"auto", "admm", "interior-point", "newton"});
}
double reachable(std::string_view method) { return is_factored(method) ? 1e-10 : 1e-6; }

void report(const char* file, int line, const Case& c, std::string_view method, Law law,
            const std::string& what) {
  check::fail(file, line,
              c.name + ", " + std::string(method) + ", " + (law == Law::coulomb ? "coulomb" : "associated") +
                  ": " + what);
}
#define EXPECT(condition)                                                     \
  do {                                                                        \
    if (!(condition)) report(__FILE__, __LINE__, c, method, law, #condition); \
  } while (false)

// Everything that a converged solution promises, each checked by other means than the solver's own.
void check_solution(const Case& c, std::string_view method, Law law, double tolerance,
                    const Options& given = {}) {
  const Problem& p = c.problem;
  Options options = given;
  options.law = law;
  options.tolerance = tolerance;
  const Solution s = solve(p, method, options);
  EXPECT(s.status == Status::converged);
  EXPECT(s.residual <= tolerance);
  EXPECT(s.x.size() == p.rows() && s.u.size() == p.rows());
  const std::string violation = kkt::violation(p, law, tolerance, s.x);
  if (!violation.empty()) report(__FILE__, __LINE__, c, method, law, violation);
  EXPECT(std::abs(s.residual - residual(p, law, s.x)) <= 1e-12 + 1e-9 * s.residual);
  Vector u(p.rows());
  product(p.A, s.x, u);
  double objective = 0, size = 1e-300;
  for (std::size_t i = 0; i < u.size(); ++i) {
    objective += s.x[i] * (0.5 * u[i] + p.b[i]);
    size += std::abs(s.x[i] * u[i]) + std::abs(s.x[i] * p.b[i]);
    u[i] += p.b[i];
  }
  EXPECT(u == s.u);
  EXPECT(std::abs(s.objective - objective) <= 1e-13 * size);
  EXPECT(s.products >= 1 && s.time >= 0);
  // A method that is a table of phases names the phase that made x, and tells that the asked one ran.
  const auto ran = [&](const PhaseRecord& phase) { return phase.method == method; };
  if (method != "auto") EXPECT(s.method == method || std::any_of(s.phases.begin(), s.phases.end(), ran));
}

bool same_bits(const Vector& a, const Vector& b) {
  return a.size() == b.size() && (a.empty() || !std::memcmp(a.data(), b.data(), a.size() * sizeof(double)));
}

}  // namespace

// Breaks when any method does not reach its tolerance under either law, or calls something a solution that is
// none: the KKT conditions are checked by kkt.hpp, which does not know the residual.
TEST(every_method_solves_contacts) {
  for (const Case& c : small::contact_cases())
    for (std::string_view method : method_names())
      for (Law law : laws)
        if (!is_linear_only(method)) check_solution(c, method, law, reachable(method));
}

// Breaks when mass ratios, much sliding or redundant contacts stop a second-order method short of 1e-10.
TEST(second_order_methods_solve_hard_contacts) {
  for (const Case& c : small::hard_cases())
    for (Law law : laws) {
      check_solution(c, "auto", law, 1e-10);
      check_solution(c, "interior-point", law, 1e-10);
    }
}

// Breaks when a linear system is not solved by everyone, singular and consistent ones included. The law does
// not matter.
TEST(every_method_solves_bilateral_problems) {
  for (const Case& c : small::bilateral_cases())
    for (std::string_view method : method_names())
      for (Law law : laws) check_solution(c, method, law, is_linear_only(method) ? 1e-10 : reachable(method));
}

// Breaks when a method needs a certain kind of operator although any product would do, or counts products
// that it did not make: the callback counts for itself.
TEST(products_are_counted) {
  for (const Case& c : {Case{"sliding stack", small::stack(3, 2, 0.05)}, Case{"chain", small::chain(8)}})
    for (std::string_view method : {"p-spg-fb", "p-spg-fb-literal", "apgd", "jacobi", "cg", "minres"})
      for (Law law : laws) {
        if (is_linear_only(method) && !c.problem.K.all_free()) continue;
        std::size_t calls = 0;
        CallbackOperator A;
        A.diag.resize(c.problem.rows());
        diagonal(c.problem.A, A.diag);
        A.function = [&](std::span<const double> x, std::span<double> y) {
          ++calls, product(c.problem.A, x, y);
        };
        const Problem p = make_problem(std::move(A), c.problem.b, c.problem.K);
        calls = 0;
        Options options;
        options.law = law;
        const Solution s = solve(p, method, options);
        EXPECT(s.status == Status::converged);
        EXPECT(s.products == calls);
      }
}

// Breaks when the fused stages of contacts lead somewhere else than the plain ones on the same problem.
TEST(solution_does_not_depend_on_the_kind_of_operator) {
  for (const Case& c :
       {Case{"mechanism", small::mechanism()}, Case{"world contacts", small::world_contacts(3)}})
    for (Law law : laws) {
      const Problem& p = c.problem;
      const Vector A = small::dense_matrix(p.A);
      const Problem others[] = {make_problem(small::dense_operator(A, p.rows()), p.b, p.K),
                                make_problem(small::sparse_operator(A, p.rows()), p.b, p.K),
                                make_problem(std::get<ContactSystem>(p.A).stored(), p.b, p.K)};
      Options options;
      options.law = law;
      options.tolerance = 1e-9;
      for (std::string_view method : {"p-spg-fb", "auto"}) {
        const Solution s = solve(p, method, options);
        EXPECT(s.status == Status::converged);
        for (const Problem& other : others) {
          const Solution t = solve(other, method, options);
          EXPECT(t.status == Status::converged);
          // x is not unique where A is singular; u and the objective of the convex law are.
          if (law == Law::associated)
            EXPECT(std::abs(s.objective - t.objective) <= 1e-8 * std::abs(s.objective));
          const std::string violation = kkt::violation(p, law, 3e-9, t.x);
          if (!violation.empty()) report(__FILE__, __LINE__, c, method, law, violation);
        }
      }
    }
}

// Breaks when uninitialised memory or an unordered sum gets into a result.
TEST(same_bits_twice) {
  for (const Case& c : small::contact_cases())
    for (std::string_view method : method_names())
      for (Law law : laws) {
        if (is_linear_only(method)) continue;
        Options options;
        options.law = law;
        options.max_iterations = 200;
        const Solution s = solve(c.problem, method, options), t = solve(c.problem, method, options);
        EXPECT(same_bits(s.x, t.x) && same_bits(s.u, t.u));
        EXPECT(s.iterations == t.iterations && s.products == t.products && s.residual == t.residual);
      }
}

// Large enough to be split: 900 boxes are 3600 contacts in several chunks. Breaks when chunks or the order of
// their sums follow from the number of threads.
TEST(same_bits_with_two_threads) {
  const Case c{"tall stack", small::stack(900, 3, 0.01)};
  const std::string_view method = "p-spg-fb";
  for (Law law : laws) {
    Options options;
    options.law = law;
    options.max_iterations = 60;
    const Solution one = solve(c.problem, method, options);
    for (unsigned threads : {2u, 3u}) {
      options.threads = threads;
      const Solution several = solve(c.problem, method, options);
      EXPECT(same_bits(one.x, several.x) && same_bits(one.u, several.u) && one.residual == several.residual);
    }
  }
}

// Breaks when a solution is worked on again: it is within the tolerance before the first iteration.
TEST(solution_as_start_converges_at_once) {
  for (const Case& c : small::contact_cases())
    for (std::string_view method : method_names())
      for (Law law : laws) {
        if (is_linear_only(method)) continue;
        Options options;
        options.law = law;
        options.tolerance = reachable(method);
        const Solution first = solve(c.problem, method, options);
        options.x0 = first.x;
        options.tolerance *= 1.01;  // the residual of x0 is formed with other roundings
        const Solution again = solve(c.problem, method, options);
        EXPECT(again.status == Status::converged);
        EXPECT(again.iterations == 0);
      }
}

// A warm start is never worse than a cold one: nonsense is put aside, a point near the solution is used, and
// whatever x0 is, what comes back after few iterations is no worse than the cold start Pi_K(0). Breaks when
// x0 is taken unseen, put aside where it is good, or is not projected first.
TEST(warm_start_is_never_worse) {
  for (const Case& c : small::contact_cases())
    for (std::string_view method : method_names())
      for (Law law : laws) {
        if (is_linear_only(method) || c.name == "one open contact") continue;
        Options options;
        options.law = law;
        options.max_iterations = 3;
        // auto and interior-point put a first-order phase before the others when there is a start.
        const bool phases = one_of(method, {"auto", "interior-point"});
        const Solution cold = solve(c.problem, method, options);
        const Vector nonsense(c.problem.rows(), 1e7);
        Vector zero(c.problem.rows());
        project(c.problem.K, zero, zero);
        options.x0 = nonsense;
        const Solution warm = solve(c.problem, method, options);
        if (!phases) EXPECT(same_bits(warm.x, cold.x));
        EXPECT(warm.residual <= residual(c.problem, law, zero) * (1 + 1e-12));

        options.x0 = {};
        options.max_iterations = 0;
        Vector near = solve(c.problem, "interior-point", options).x;
        for (double& v : near) v *= 1.0001;
        Vector start = near;
        project(c.problem.K, start, start);
        const double r0 = residual(c.problem, law, start);
        options.x0 = near;
        options.max_iterations = 3;
        const Solution close = solve(c.problem, method, options);
        EXPECT(close.residual <= r0 * (1 + 1e-9));
      }
}

// The records of a solve are those of the solve: numbered, in order, with best_residual the running minimum.
// Breaks when a phase of a method starts its count or its clock anew, records an iteration twice, or when
// what is returned is not the best that was recorded.
TEST(history_is_consistent) {
  for (const Case& c : {Case{"mechanism", small::mechanism()}, Case{"chain", small::chain(8)}})
    for (std::string_view method : method_names())
      for (Law law : laws) {
        if (is_linear_only(method) && !c.problem.K.all_free()) continue;
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
          EXPECT(r.iteration == before.iteration + 1 || r.iteration == before.iteration);
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
// history what it would not have worked anyway, as minres once did for the objective.
TEST(history_costs_no_products) {
  for (const Case& c : {Case{"mechanism", small::mechanism()}, Case{"chain", small::chain(8)}})
    for (std::string_view method : method_names()) {
      if (is_linear_only(method) && !c.problem.K.all_free()) continue;
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

// The loop of the paper with every vector and every objective kept: objective, alpha and backtracks of each
// iteration under the associated law.
std::vector<IterationRecord> spg_of_the_paper(const Problem& p, const SpgOptions& o, std::size_t iterations) {
  const std::size_t m = p.rows();
  Vector P(m), x(m), f;
  for_each_block(p.K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
    for (int k = 0; k < Set::dim; ++k) P[row + k] = p.P[block];
  });
  const auto gradient = [&](const Vector& at) {
    Vector g(m);
    product(p.A, at, g);
    for (std::size_t i = 0; i < m; ++i) g[i] += p.b[i];
    return g;
  };
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
        options.history = true;
        options.tolerance = 0;
        options.max_iterations = 25;
        options.spg.memory = memory;
        options.spg.alpha_max = alpha_max;
        const auto found = spg_literal(c.problem, options).history;
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
  options.tolerance = 1e-3;
  const Solution krylov = cg(p, options);
  for (std::string_view method : {"p-spg-fb", "p-spg-fb-literal"}) {
    const Solution s = solve(p, method, options);
    CHECK(s.status == Status::converged);
    CHECK(s.products <= 4 * krylov.products);
  }
}

// Breaks when an answer known by hand comes out differently: one row 2 x + b in every kind of set.
TEST(one_row_by_hand) {
  struct {
    double lo, hi, b, x;
  } rows[] = {{-INFINITY, INFINITY, 3, -1.5},
              {0, INFINITY, 3, 0},
              {0, INFINITY, -3, 1.5},
              {-1, 1, -3, 1},
              {-1, 1, 3, -1},
              {-1, 1, 1, -0.5},
              {2, INFINITY, 1, 2},
              {-INFINITY, -2, 1, -2},
              {0.5, 0.5, 7, 0.5}};
  for (const auto& row : rows) {
    SetProduct K;
    if (std::isinf(row.lo) && std::isinf(row.hi))
      K.add_count<Free>(1);
    else if (row.lo == 0)
      K.add_count<NonNegative>(1);
    else
      K.add_each<Interval>(Vector{row.lo}, Vector{row.hi});
    const Case c{"one row", small::one_row(K, 2, row.b)};
    for (std::string_view method : method_names()) {
      if (is_linear_only(method) && !c.problem.K.all_free()) continue;
      const Law law = Law::associated;
      Options options;
      options.tolerance = 1e-9;
      const Solution s = solve(c.problem, method, options);
      EXPECT(s.status == Status::converged);
      EXPECT(std::abs(s.x[0] - row.x) <= 1e-8);
    }
  }
}

// One point mass, by hand: under coulomb it slides without lift, x = (1, -mu); under the associated law it
// lifts. Breaks when a method leaves the De Saxce term out, or adds it under the other law.
TEST(one_contact_by_hand) {
  const Case c{"one sliding contact", small::one_contact(0.5, -1, 2)};
  for (std::string_view method : method_names()) {
    if (is_linear_only(method)) continue;
    for (Law law : laws) {
      Options options;
      options.law = law;
      options.tolerance = 1e-9;
      const Solution s = solve(c.problem, method, options);
      const double n = law == Law::coulomb ? 1 : 1.6;
      EXPECT(std::abs(s.x[0] - n) <= 1e-7 && std::abs(s.x[1] + 0.5 * n) <= 1e-7 && std::abs(s.x[2]) <= 1e-7);
    }
  }
}

// Breaks at sizes that nobody thinks of: no rows, with and without bodies; one body without contacts.
TEST(zero_rows) {
  ContactSystem lonely;
  small::add_body(lonely, 1, {1, 1, 1});
  for (const Case& c : {Case{"dense", make_problem(small::dense_operator({}, 0), {}, {})},
                        Case{"contacts", make_problem(ContactSystem{}, {}, {})},
                        Case{"bodies", make_problem(ContactSystem{}, {}, {})},
                        Case{"one body", make_problem(lonely, {}, {})}})
    for (std::string_view method : method_names())
      for (Law law : laws) {
        Options options;
        options.law = law;
        const Solution s = solve(c.problem, method, options);
        EXPECT(s.status == Status::converged && s.x.empty() && s.u.empty());
        EXPECT(s.residual == 0 && s.objective == 0);
      }
}

// Breaks when extreme units, friction or mass ratios overflow: the same problem in other units has the same
// solution.
TEST(extreme_units) {
  const Problem p = small::stack(3, 2, 0.05);
  for (double unit : {1e-12, 1e12})
    for (Law law : laws)
      for (std::string_view method : {"auto", "interior-point", "newton", "p-spg-fb", "admm"}) {
        Case c{"stack in other units", p};
        auto& A = std::get<ContactSystem>(c.problem.A);
        for (double& v : A.bodies.inverse_mass) v *= unit;
        for (auto& I : A.bodies.inverse_inertia)
          for (double& v : I) v *= unit;
        c.problem = make_problem(A, p.b, p.K);
        check_solution(c, method, law, 1e-6);
      }
}

// Breaks when a method that needs the rows of A, or K = R^m, is silently replaced by another one.
TEST(methods_refuse_what_they_cannot_do) {
  const Problem contacts = small::stack(2), callback = small::as_callback(contacts);
  Options options;
  for (std::string_view method : {"cg", "minres"})
    CHECK_THROWS(solve(contacts, method, options), "purely bilateral problems");
  for (std::string_view method : {"admm", "interior-point", "newton"})
    CHECK_THROWS(solve(callback, method, options), "which a function operator does not allow");
  CHECK_THROWS(solve(callback, "gauss-seidel", options), "needs the rows of A");
  CHECK_THROWS(solve(contacts, "simplex", options),
               "unknown method 'simplex'; the methods are auto, p-spg-fb");
  CHECK(solve(callback, "auto", options).method == "p-spg-fb");
  for (std::string_view method : method_names())
    CHECK_THROWS(solve(contacts, std::string(method) + "x", options), method);
}

// Breaks when auto does not tell every phase that ran, or names a method that made no x.
TEST(auto_explains_itself) {
  const Options options;
  for (const Problem& p : {small::stack(2), small::chain(3), small::as_callback(small::stack(2))}) {
    const Solution s = solve(p, "auto", options);
    CHECK(s.status == Status::converged && s.method != "auto");
    CHECK(!s.phases.empty());
    bool made_x = false;
    for (const PhaseRecord& phase : s.phases) {
      CHECK(s.reason.find(phase.method + " (" + std::to_string(phase.iterations) + " iterations") !=
            std::string::npos);
      made_x = made_x || phase.method == s.method;
    }
    CHECK(made_x);
  }
}

// Breaks when a long hinge chain, as stiff as a beam and with one redundant row per hinge, is left to plain
// conjugate gradients, which do not reach 1e-3 in 2000 iterations, or when redundancy spoils the
// factorisation.
TEST(auto_solves_redundant_joint_chains_at_once) {
  for (double compliance : {0.0, 1e-9}) {
    ContactSystem A;
    Vector v;
    for (int i = 0; i < 100; ++i) {
      const double mass = i == 99 ? 1000 : 1;
      small::add_body(A, mass, {0.01 * mass, 0.01 * mass, 0.01 * mass});
      for (double z : {0.0, 0.01})
        small::add_ball_joint(A, i, i - 1, {-0.05, 0, z}, {i > 0 ? 0.05 : 0.0, 0, z}, compliance);
      v.insert(v.end(), {0, 0, -0.05, 0, 0, 0});
    }
    Vector b = small::row_velocities(A, v);
    SetProduct K;
    K.add_count<Free>(A.rows());
    const Problem p = make_problem(std::move(A), std::move(b), std::move(K));
    Options options;
    options.tolerance = 1e-8;
    const Solution s = solve(p, "auto", options);
    CHECK(s.status == Status::converged && s.method == "cg");
    CHECK(s.factorizations == 1 && s.iterations <= 30);
  }
}

// Breaks when auto has no bound of its own where the tolerance cannot be reached, or returns less than its
// best.
TEST(auto_is_bounded_without_limits) {
  for (int boxes : {3, 40, 260})  // above 250, contacts are too many for Newton's method
    for (Law law : laws) {
      const Problem p = small::stack(boxes, 30, 0.1 / boxes, 2);
      Options options;
      options.law = law;
      options.tolerance = 0;
      const Solution s = solve(p, "auto", options);
      CHECK(s.status == Status::stalled);
      CHECK(s.iterations < 100000 && s.residual < 1e-3);
    }
}

// What a simulation meets: friction from none to 2, a body that cannot move, a joint with a redundant row of
// tiny compliance, limited efforts. Breaks when auto does not reach its tolerance on one of them, cold or
// warm.
TEST(auto_solves_coulomb_steps) {
  for (double mu : {0.0, 0.3, 1.0, 2.0})
    for (int boxes : {1, 5, 25}) {
      const Problem boxes_only = small::stack(boxes, 3, 0.02, mu);
      ContactSystem A = std::get<ContactSystem>(boxes_only.A);
      small::add_fixed_body(A);
      for (int twice = 0; twice < 2; ++twice)
        small::add_ball_joint(A, 0, boxes, {0.5, 0, 0}, {0, 0, 0}, 1e-9);
      A.jacobian.push_back({0, boxes, {0.1, 0, 0, 0, 0, 1}, {}});
      A.compliance.push_back(0);
      SetProduct K;
      K.append(std::span(boxes_only.K.all<Friction>()));
      K.add_count<Free>(6);
      K.add_each<Interval>(Vector{-1e-3}, Vector{1e-3});
      Vector v;
      for (int i = 0; i < boxes; ++i) v.insert(v.end(), {0.02 * i, 0.006 * i, -0.0981, 0, 0, 0});
      v.insert(v.end(), 6, 0.0);
      const Vector b = small::row_velocities(A.stored(), v);
      const Problem p = make_problem(std::move(A), b, std::move(K));
      Options options;
      options.law = Law::coulomb;
      const Solution cold = solve(p, "auto", options);
      CHECK(cold.status == Status::converged);
      Vector x0 = cold.x;
      for (std::size_t i = 0; i < x0.size(); ++i) x0[i] *= 1 + 0.01 * std::sin(i);
      options.x0 = x0;
      CHECK(solve(p, "auto", options).status == Status::converged);
    }
}

// Breaks when a senseless option is accepted, or its message does not name it.
TEST(bad_options_are_named) {
  const Problem p = small::stack(1);
  const auto with = [&](auto&& change) {
    Options options;
    change(options);
    return solve(p, "p-spg-fb", options);
  };
  const Vector short_start(2), bad_start{0, 0, NAN, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  CHECK_THROWS(with([](Options& o) { o.tolerance = -1; }), "tolerance");
  CHECK_THROWS(with([](Options& o) { o.tolerance = NAN; }), "tolerance");
  CHECK_THROWS(with([](Options& o) { o.deadline = 0; }), "deadline");
  CHECK_THROWS(with([](Options& o) { o.deadline = NAN; }), "deadline");
  CHECK_THROWS(with([](Options& o) { o.threads = 0; }), "threads");
  CHECK_THROWS(with([&](Options& o) { o.x0 = short_start; }), "x0 has 2 entries");
  CHECK_THROWS(with([&](Options& o) { o.x0 = bad_start; }), "x0[2]");
  CHECK_THROWS(with([](Options& o) { o.spg.alpha_min = 0; }), "alpha_min");
  CHECK_THROWS(with([](Options& o) { o.spg.alpha_min = 2, o.spg.alpha_max = 1; }), "alpha_max");
  CHECK_THROWS(with([](Options& o) { o.spg.sigma_min = 0.9, o.spg.sigma_max = 0.1; }), "sigma_min");
  CHECK_THROWS(with([](Options& o) { o.spg.sigma_max = 1; }), "sigma_max");
  CHECK_THROWS(with([](Options& o) { o.spg.memory = SIZE_MAX; }), "memory");
  CHECK_THROWS(with([](Options& o) { o.spg.gamma = 1; }), "gamma");
  CHECK_THROWS(with([](Options& o) { o.spg.tau_g = 0; }), "tau_g");
  CHECK_THROWS(with([](Options& o) { o.sor.omega = 2; }), "omega");
  CHECK_THROWS(with([](Options& o) { o.jacobi.omega = -1; }), "omega");
  CHECK_THROWS(with([](Options& o) { o.admm.rho = INFINITY; }), "rho");
}
