#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "kkt.hpp"
#include "method_case.hpp"
#include "problems.hpp"

using namespace amontons;
using namespace method_case;
using small::Case;
using small::same_bits;
using small::Vector;

namespace {

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
        if (is_linear_only(method) && !c.problem.K.all_bilateral()) continue;
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
      K.add_count<Bilateral>(1);
    else if (row.lo == 0)
      K.add_count<NonNegative>(1);
    else
      K.add_each<Interval>(Vector{row.lo}, Vector{row.hi});
    const Case c{"one row", small::one_row(K, 2, row.b)};
    for (std::string_view method : method_names()) {
      if (is_linear_only(method) && !c.problem.K.all_bilateral()) continue;
      const Law law = Law::associated;
      Options options;
      options.law = Law::associated;
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
      for (std::string_view method : {"auto", "interior-point", "newton", "p-spg-fb"}) {
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
  options.law = Law::associated;
  for (std::string_view method : {"cg", "minres"})
    CHECK_THROWS(solve(contacts, method, options), "purely bilateral problems");
  for (std::string_view method : {"interior-point", "newton"})
    CHECK_THROWS(solve(callback, method, options), "which a function operator does not allow");
  CHECK_THROWS(solve(callback, "gauss-seidel", options), "needs the rows of A");
  CHECK_THROWS(solve(contacts, "simplex", options),
               "unknown method 'simplex'; the methods are auto, p-spg-fb");
  CHECK_THROWS(solve(contacts, "admm", options), "use 'interior-point'");
  CHECK(solve(callback, "auto", options).method == "apgd");
  for (std::string_view method : method_names())
    CHECK_THROWS(solve(contacts, std::string(method) + "x", options), method);
}

// Breaks when a senseless option is accepted, or its message does not name it.
TEST(bad_options_are_named) {
  const Problem p = small::stack(1);
  const auto with = [&](auto&& change) {
    Options options;
    options.law = Law::associated;
    change(options);
    return solve(p, "p-spg-fb", options);
  };
  const Vector short_start(2), bad_start{0, 0, NAN, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  CHECK_THROWS(with([](Options& o) { o.tolerance = -1; }), "tolerance");
  CHECK_THROWS(with([](Options& o) { o.tolerance = NAN; }), "tolerance");
  CHECK_THROWS(with([](Options& o) { o.deadline = 0; }), "deadline");
  CHECK_THROWS(with([](Options& o) { o.deadline = NAN; }), "deadline");
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
}
