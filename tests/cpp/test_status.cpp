#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;
using small::Vector;

// Every way in which a solve can end is reached here, by every method that can reach it.

namespace {

constexpr Law laws[] = {Law::associated, Law::coulomb};

bool is_linear_only(std::string_view method) { return method == "cg" || method == "minres"; }

// A problem that keeps the method busy for longer than the tests wait: linear for the methods that need it.
const Problem& long_problem(std::string_view method) {
  static const Problem contacts = small::stack(150, 1000, 0.3), joints = small::chain(400, true);
  return is_linear_only(method) ? joints : contacts;
}

double cold_residual(const Problem& p, Law law) {
  Vector x(p.rows());
  project(p.K, x, x);
  return residual(p, law, x);
}

// What is promised of every result, however the solve ended: finite, in K, and no worse than the cold start.
void check_valid(const Problem& p, Law law, const Solution& s, std::string_view method) {
  const bool finite = std::all_of(s.x.begin(), s.x.end(), [](double v) { return std::isfinite(v); });
  const double r = residual(p, law, s.x), cold = cold_residual(p, law);
  double size = 0;
  for (double v : s.x) size = std::max(size, std::abs(v));
  if (!finite || distance(p.K, s.x) > 1e-12 * size || !(r <= cold * (1 + 1e-9)) ||
      std::abs(r - s.residual) > 1e-9 * r)
    check::fail(__FILE__, __LINE__,
                std::string(method) + ": residual " + check::number(s.residual) + " reported, " +
                    check::number(r) + " found, " + check::number(cold) + " at the start, outside K by " +
                    check::number(distance(p.K, s.x)));
}

void expect(Status found, Status expected, std::string_view method, const char* file, int line) {
  static const char* names[] = {"converged", "iteration_limit", "deadline",
                                "stalled",   "interrupted",     "infeasible"};
  if (found != expected)
    check::fail(file, line,
                std::string(method) + " ends with " + names[static_cast<int>(found)] + ", not with " +
                    names[static_cast<int>(expected)]);
}
#define EXPECT_STATUS(found, expected, method) expect((found), (expected), (method), __FILE__, __LINE__)

}  // namespace

// Breaks when a method ends an easy solve for another reason, or calls a residual above the tolerance
// converged.
TEST(converged) {
  const Problem contacts = small::stack(2), joints = small::chain(3);
  for (std::string_view method : method_names()) {
    const Solution s = solve(is_linear_only(method) ? joints : contacts, method, {});
    EXPECT_STATUS(s.status, Status::converged, method);
    CHECK(s.residual <= 1e-6);
  }
}

// Breaks when a limit is overrun, or the best iterate is lost.
TEST(iteration_limit) {
  for (std::string_view method : method_names())
    for (Law law : laws)
      for (std::size_t limit : {1, 2, 7}) {
        const Problem& p = long_problem(method);
        Options options;
        options.law = law;
        options.max_iterations = limit;
        options.tolerance = 1e-14;
        const Solution s = solve(p, method, options);
        EXPECT_STATUS(s.status, Status::iteration_limit, method);
        CHECK(s.iterations == limit);
        check_valid(p, law, s, method);
      }
}

// Breaks when a method looks at the clock too rarely, or returns a half-finished iterate. The deadlines end
// in the set-up, in the first iterations and later.
TEST(deadline) {
  for (std::string_view method : method_names())
    for (Law law : laws)
      for (double deadline : {1e-9, 3e-4, 0.02}) {
        const Problem& p = long_problem(method);
        Options options;
        options.law = law;
        options.deadline = deadline;
        options.tolerance = 0;
        options.max_iterations = 1000000000;
        const auto start = std::chrono::steady_clock::now();
        const Solution s = solve(p, method, options);
        const double time = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        // Direct methods may come to their end before the latest deadline.
        if (s.status != Status::stalled && s.status != Status::converged)
          EXPECT_STATUS(s.status, Status::deadline, method);
        CHECK(time < deadline + 2);  // generous: sanitizers and shared machines
        check_valid(p, law, s, method);
      }
}

// Breaks when a solve that cannot improve runs for ever: tolerances below rounding.
TEST(stalled) {
  const Problem contacts = small::world_contacts(2), joints = small::chain(2);
  for (std::string_view method : method_names())
    for (Law law : laws) {
      if (check::sanitized && law != Law::coulomb) continue;  // a sixth of the time of all tests
      // Projected Jacobi and Gauss-Seidel creep on for ever on a stack.
      const bool linear = is_linear_only(method) || method == "jacobi" || method == "gauss-seidel";
      const Problem& p = linear ? joints : contacts;
      Options options;
      options.law = law;
      options.tolerance = 1e-300;
      options.max_iterations = 1000000000;
      const Solution s = solve(p, method, options);
      EXPECT_STATUS(s.status, Status::stalled, method);
      // The literal variant compares values of the objective, whose last bits hide what is left to gain.
      if (!(s.residual < (method == "p-spg-fb-literal" ? 1e-6 : 1e-9)))
        check::fail(__FILE__, __LINE__, std::string(method) + " stalls at " + check::number(s.residual));
      check_valid(p, law, s, method);
    }
}

// Breaks when the wish of the callback is not obeyed at once, or not passed on by the phases of a method.
TEST(interrupted_by_the_callback) {
  for (std::string_view method : method_names())
    for (Law law : laws)
      for (std::size_t at : {0, 3}) {
        const Problem& p = long_problem(method);
        Options options;
        options.law = law;
        options.tolerance = 1e-14;
        std::size_t calls = 0;
        options.callback = [&](const IterationRecord&) { return calls++ == at; };
        const Solution s = solve(p, method, options);
        EXPECT_STATUS(s.status, Status::interrupted, method);
        CHECK(calls == at + 1);
        check_valid(p, law, s, method);
      }
}

// Breaks when the poll, which stands for Ctrl-C, is forgotten by a method or one of its phases.
TEST(interrupted_by_the_poll) {
  for (std::string_view method : method_names())
    for (Law law : laws) {
      const Problem& p = long_problem(method);
      Options options;
      options.law = law;
      options.tolerance = 0;
      options.max_iterations = 1000000000;
      options.deadline = 60;
      int polls = 0;
      options.interrupted = [&] { return ++polls >= 2; };
      const Solution s = solve(p, method, options);
      // A fast method may come to its end before the second poll.
      if (polls < 2 && (s.status == Status::stalled || s.status == Status::converged)) continue;
      EXPECT_STATUS(s.status, Status::interrupted, method);
      CHECK(polls <= 4);  // the phases of a method may each ask once more
      check_valid(p, law, s, method);
    }
}

// No velocity satisfies the constraints: impulses would grow without bound. Each with its certificate d in K,
// A d = 0, b'd < 0. Breaks when the certificate is not found, or a method calls such a problem solved.
TEST(infeasible) {
  // A contact that joins nothing that moves and yet approaches: d = e_n.
  ContactSystem fixed;
  small::add_body(fixed, 1, {0.1, 0.1, 0.1});
  small::add_fixed_body(fixed);
  fixed.contacts = {contact_between(0, -1, {0, 0, -0.5}, {0, 0, 0}, {0, 0, 1}),
                    contact_between(1, -1, {0, 0, 0}, {0, 0, 0}, {0, 0, 1})};
  fixed.contact_compliance = {0, 0};
  SetProduct two_cones;
  two_cones.add_each<Friction>(Vector{0.5, 0.5});
  const Problem approach = make_problem(fixed, {-1, 0.2, 0, -1, 0, 0}, two_cones);
  // A body pressed between two walls that close in: d = (1, 1).
  SetProduct two_rows;
  two_rows.add_count<NonNegative>(2);
  const Problem squeezed = make_problem(small::dense_operator({1, -1, -1, 1}, 2), {-1, -0.5}, two_rows);
  // Two bilateral rows that say different things: d = (1, -1).
  SetProduct bilateral;
  bilateral.add_count<Bilateral>(2);
  const Problem contradiction = make_problem(small::dense_operator({1, 1, 1, 1}, 2), {1, 2}, bilateral);

  for (const auto& [name, p] :
       {std::pair{"approach", &approach}, {"squeezed", &squeezed}, {"contradiction", &contradiction}})
    for (std::string_view method : method_names()) {
      if (is_linear_only(method) && !p->K.all_bilateral()) continue;
      Options options;
      options.law = Law::associated;
      const Solution s = solve(*p, method, options);
      // The others run off along d too, but their best iterate, the first one, does not show it.
      const bool detects =
          is_linear_only(method) || method == "auto" || method == "p-spg-fb" || method == "p-spg-fb-literal";
      if (detects || s.status == Status::converged)
        EXPECT_STATUS(s.status, Status::infeasible, std::string(method) + " on " + name);
      check_valid(*p, Law::associated, s, method);
    }
}

// Breaks when a feasible problem is called infeasible because the solve was cut short or x is large.
TEST(feasible_problems_are_never_called_infeasible) {
  std::vector<small::Case> cases = small::contact_cases();
  for (small::Case& c : small::hard_cases()) cases.push_back(c);
  for (const small::Case& c : cases)
    for (std::string_view method : method_names())
      for (Law law : laws)
        for (std::size_t limit : {1, 20}) {
          if (is_linear_only(method)) continue;
          Options options;
          options.law = law;
          options.max_iterations = limit;
          options.tolerance = 1e-15;
          CHECK(solve(c.problem, method, options).status != Status::infeasible);
        }
}

// Breaks when the recorded residual of a method falls while the true one stands: a body between two contacts
// that contradict each other (its floor rises, its ceiling falls) has no solution, and its impulses run off.
// The velocity that is missing, 2, is that at zero impulses: no iterate has a residual below 1 / sqrt(2), as
// at best one of the two contacts is satisfied.
TEST(contradiction_never_looks_converged) {
  ContactSystem A;
  small::add_body(A, 1, {0.1, 0.1, 0.1});
  A.contacts = {contact_between(0, -1, {0, 0, -0.5}, {0, 0, 0}, {0, 0, 1}),
                contact_between(0, -1, {0, 0, 0.5}, {0, 0, 0}, {0, 0, -1})};
  A.contact_compliance = {0, 0};
  SetProduct K;
  K.add_each<Friction>(Vector{0.5, 0.5});
  const Problem p = make_problem(A, {-1, 0, 0, -1, 0, 0}, K);
  for (std::string_view method : {"p-spg-fb", "apgd"})
    for (Law law : {Law::associated, Law::coulomb}) {
      Options options;
      options.law = law;
      options.history = true;
      options.max_iterations = 3000;
      const Solution s = solve(p, method, options);
      CHECK(s.status != Status::converged);
      for (const IterationRecord& record : s.history) CHECK(record.residual > 0.7);
    }
}
