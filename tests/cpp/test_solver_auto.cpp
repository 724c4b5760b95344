#include <cmath>
#include <span>
#include <string>
#include <variant>

#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;
using small::Vector;

// Breaks when auto does not tell every phase that ran, or names a method that made no x.
TEST(auto_explains_itself) {
  Options options;
  options.law = Law::associated;
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
    K.add_count<Bilateral>(A.rows());
    const Problem p = make_problem(std::move(A), std::move(b), std::move(K));
    Options options;
    options.law = Law::associated;
    options.tolerance = 1e-8;
    const Solution s = solve(p, "auto", options);
    CHECK(s.status == Status::converged && s.method == "elimination");
    CHECK(s.factorizations == 1 && s.iterations <= 30);
  }
}

// Breaks when auto has no bound of its own where the tolerance cannot be reached, or returns less than its
// best.
TEST(auto_is_bounded_without_limits) {
  for (int boxes : {3, 40, 260}) {             // above 250, contacts are too many for Newton's method
    if (boxes > 3 && check::sanitized) break;  // minutes
    for (Law law : {Law::associated, Law::coulomb}) {
      const Problem p = small::stack(boxes, 30, 0.1 / boxes, 2);
      Options options;
      options.law = law;
      options.tolerance = 0;
      const Solution s = solve(p, "auto", options);
      CHECK(s.status == Status::stalled);
      CHECK(s.iterations < 500000 && s.residual < 1e-3);
    }
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
      K.add_count<Bilateral>(6);
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

// Breaks when a turn depends on anything but the problem: on the clock, or on the number of threads.
TEST(auto_takes_the_same_turns_with_any_number_of_threads) {
  const Problem p = small::stack(40, 30, 0.1, 0.4);
  for (Law law : {Law::associated, Law::coulomb}) {
    Options options;
    options.law = law;
    options.tolerance = 1e-8;
    const Solution one = solve(p, "auto", options);
    for (unsigned threads : {2, 3}) {
      options.threads = threads;
      const Solution many = solve(p, "auto", options);
      CHECK(many.x == one.x && many.reason == one.reason && many.products == one.products);
    }
  }
}

// First-order iterations that auto makes.
double cheap_iterations(const Problem& problem) {
  Options options;
  options.law = Law::associated;
  options.tolerance = 1e-6;
  const Solution s = solve(problem, "auto", options);
  CHECK(s.status == Status::converged);
  double count = 0;
  for (const PhaseRecord& phase : s.phases)
    if (phase.method == std::string("apgd") || phase.method == std::string("p-spg-fb"))
      count += static_cast<double>(phase.iterations);
  return count;
}

// The same problems with contacts given as rows of D, as files have them: products cost a little more, so
// that auto makes about as many of them before it factors. Breaks when it prices either form wrongly by
// a factor of two. In the mean, as turns grow by quarters.
TEST(auto_prices_products_of_stored_rows) {
  double sum = 0, count = 0;
  for (int boxes : {20, 30, 40, 50, 60, 75, 90, 110, 130}) {
    const Problem p = small::stack(boxes, 30, 0.1, 0.4);
    const Problem rows = make_problem(std::get<ContactSystem>(p.A).stored(), Vector(p.b), SetProduct(p.K));
    sum += cheap_iterations(rows) / cheap_iterations(p);
    ++count;
  }
  const double ratio = sum / count;
  CHECK(ratio > 0.65 && ratio < 1.25);
}

// Problems on which first-order methods creep where those that factor succeed (a long chain of joints), and
// which factoring ones cannot have (a function). Breaks when auto stays with a contender that gets
// nowhere, or fails where one of them succeeds.
TEST(auto_succeeds_where_one_method_does) {
  Options options;
  options.law = Law::associated;
  options.tolerance = 1e-8;
  Options bounded = options;
  bounded.max_iterations = 300;
  const Problem stiff = small::chain(300, true);
  CHECK(solve(stiff, "p-spg-fb", bounded).status != Status::converged);
  CHECK(solve(stiff, "auto", options).status == Status::converged);
  const Problem hidden = small::as_callback(small::stack(6));
  CHECK(solve(hidden, "p-spg-fb", options).status == Status::converged);
  CHECK(solve(hidden, "auto", options).status == Status::converged);
}

// Breaks when a method that was left loses its state: the iterations of its turns are those of one run, with
// the same bits, so that auto, where only its first method is of use, ends where that one alone does.
TEST(a_run_in_turns_is_the_same_as_one) {
  const Problem p = small::stack(12, 10, 0.1, 0.4);
  Options options;
  options.law = Law::associated;
  options.tolerance = 1e-9;
  const Solution whole = apgd(p, options, small::no_limit);
  const auto run = start_apgd(p, options, small::no_limit);
  while (!run->advance(7)) {
  }
  const Solution parts = run->finish();
  CHECK(parts.x == whole.x && parts.iterations == whole.iterations && parts.products == whole.products);
}
