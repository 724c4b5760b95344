#include <algorithm>
#include <cmath>

#include "amontons/solvers/choice/automatic.hpp"
#include "amontons/solvers/first_order/apgd.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"
#include "solvers/direct/constrained.hpp"
#include "solvers/direct/reduction.hpp"
#include "solvers/linear/quasidefinite.hpp"

using namespace amontons;
using small::largest, small::largest_difference;
using small::solve_dense;
using small::Vector;

namespace {

// A quasidefinite matrix on a graph: bodies with random masses, joints of six rows with compliance e.
struct BlockSystem {
  std::vector<QuasidefiniteFactor::Node> kinds;
  std::vector<QuasidefiniteFactor::Edge> edges;
  Vector dense;  // with six rows per node
  QuasidefiniteFactor factor;

  BlockSystem(std::size_t bodies, const std::vector<QuasidefiniteFactor::Edge>& joints, double e) {
    small::Random random(5);
    const std::size_t nodes = bodies + joints.size(), m = 6 * nodes;
    kinds.assign(bodies, QuasidefiniteFactor::Node::body);
    for (const auto& joint : joints) {
      const Index node = static_cast<Index>(kinds.size());
      kinds.push_back(QuasidefiniteFactor::Node::joint);
      for (Index body : {joint.a, joint.b})
        if (body >= 0) edges.push_back({node, body});
    }
    factor.analyse(kinds, edges);
    factor.clear();
    dense.assign(m * m, 0.0);
    Vector root;  // of the inverse masses, six numbers per body
    for (std::size_t i = 0; i < nodes; ++i)
      for (std::size_t k = 0; k < 6; ++k) {
        const double mass = random.uniform(0.5, 2), value = i < bodies ? 1 : -e;
        root.push_back(1 / std::sqrt(mass));
        factor.diagonal(i)[7 * k] = dense[(m + 1) * (6 * i + k)] = value;
      }
    for (std::size_t j = 0; j < edges.size(); ++j)
      for (std::size_t r = 0; r < 6; ++r)
        for (std::size_t c = 0; c < 6; ++c) {
          const std::size_t row = 6 * edges[j].a + r, column = 6 * edges[j].b + c;
          const double value = random.normal() * root[column];
          dense[m * row + column] = dense[m * column + row] = value;
          factor.block(j)[factor.a_first(j) ? 6 * r + c : 6 * c + r] = value;
        }
  }

  // Of a random right-hand side: the largest difference to the dense solution, relative to it.
  double error() {
    small::Random random(9);
    const std::size_t m = 6 * kinds.size();
    const Vector r = random.vector(m), expected = solve_dense(dense, r);
    Vector z(m), found(m);
    const auto place = [&](std::size_t node) { return 6 * static_cast<std::size_t>(factor.position(node)); };
    for (std::size_t i = 0; i < kinds.size(); ++i) std::copy_n(&r[6 * i], 6, &z[place(i)]);
    CHECK(factor.factor());
    factor.forward(z.data());
    factor.backward(z.data());
    for (std::size_t i = 0; i < kinds.size(); ++i) std::copy_n(&z[place(i)], 6, &found[6 * i]);
    return largest_difference(found, expected) / largest(expected);
  }
};

// A tree of bodies on ball joints with contacts and limits: a trunk, two legs of three links that stand, an
// arm; the last foot is tied to the first by a rope (unilateral) if `tied`, by a rod (a loop) if `closed`.
Problem walker(bool closed, bool tied, double compliance) {
  ContactSystem A;
  Vector v;
  const std::array<Index, 8> parent{-1, 0, 1, 2, 0, 4, 5, 0};
  for (std::size_t i = 0; i < parent.size(); ++i) {
    const double mass = i == 0 ? 20 : 2;
    small::add_body(A, mass, {0.02 * mass, 0.03 * mass, 0.01 * mass});
    v.insert(v.end(), {0.1, 0.02, -0.05, 0.1, 0.0, 0.03});
    if (i > 0)
      small::add_ball_joint(A, static_cast<Index>(i), parent[i], {0, 0, 0.2}, {0.05, 0, -0.2}, compliance);
  }
  const std::size_t joint_rows = A.jacobian.size();
  if (closed) {
    A.jacobian.push_back({3, 6, {0, 1, 0, 0, 0, 0.1}, {0, -1, 0, 0.2, 0, 0}});
    A.compliance.push_back(compliance);
  }
  const std::size_t bilateral = A.jacobian.size() - joint_rows;
  // Limits of turning, dry friction of one joint.
  for (Index i : {2, 5, 7}) {
    A.jacobian.push_back({i, parent[i], {0, 0, 0, 5, 0, 0}, {0, 0, 0, -5, 0, 0}});
    A.compliance.push_back(0);
  }
  if (tied) {
    A.jacobian.push_back({3, 6, {-1, 0, 0, 0, 0, 0}, {1, 0, 0, 0, 0, 0}});
    A.compliance.push_back(0);
  }
  SetProduct K;
  for (Index foot : {3, 6})
    for (double x : {-0.1, 0.1}) {
      A.contacts.push_back(contact_between(foot, -1, {x, 0.02, -0.2}, {0, 0, 0}, {0, 0, 1}));
      A.contact_compliance.push_back(0);
      K.append(Friction{0.6});
    }
  Vector b = small::row_velocities(A.stored(), v);
  K.add_count<Bilateral>(joint_rows + bilateral);
  K.add_count<NonNegative>(2);
  K.add_each<Interval>(Vector{-0.01}, Vector{0.01});
  if (tied) K.add_count<NonNegative>(1);
  return make_problem(std::move(A), std::move(b), std::move(K));
}

// All problems of these tests that elimination applies to.
std::vector<small::Case> mechanisms() {
  return {{"tree", walker(false, false, 0)},
          {"compliant tree", walker(false, false, 1e-3)},
          {"loop", walker(true, false, 1e-9)},
          {"rope", walker(false, true, 0)},
          {"mechanism", small::mechanism()},
          {"contacts alone", small::stack(3)},
          {"bodies on the world", small::world_contacts(6)},
          {"joints alone", small::chain(9)},
          {"closed chain", small::chain(9, true)}};
}

}  // namespace

// Breaks when a pivot has the wrong sign, an update goes to the wrong block, or the order puts a joint
// without compliance before both of its bodies. The second bound has room for the condition of a matrix whose
// joints take nearly all freedoms, 1e6 or so.
TEST(quasidefinite_factor_solves) {
  using Edge = QuasidefiniteFactor::Edge;
  const std::vector<Edge> chain{{0, 1}, {1, 2}, {2, 3}, {3, 4}},
      tree{{-1, 0}, {0, 1}, {0, 2}, {2, 3}, {2, 4}},
      loops{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {1, 3}, {4, 4 - 1}}, apart{{0, 1}, {3, 4}};
  for (const auto& joints : {chain, tree, loops, apart}) CHECK(BlockSystem(5, joints, 0.1).error() <= 1e-12);
  for (const auto& joints : {chain, tree, apart}) CHECK(BlockSystem(5, joints, 1e-14).error() <= 1e-9);
}

// Three light bodies, each on a tree of two nodes by four rows. On the body alone they depend on each other:
// the fourth is the sum of the others. Breaks when a joint comes before coordinates of its tree. Its pivot is
// then the rounding of the body's part, 1e-16 (300)^2, in place of what the tree adds, which is of order 1.
TEST(a_joint_on_a_tree_waits_for_its_coordinates) {
  using Node = QuasidefiniteFactor::Node;
  constexpr std::size_t bodies = 3, joints = 3, first = bodies + 2, m = 6 * (first + joints), rows = 4;
  std::vector<Node> kinds(bodies, Node::body);
  kinds.insert(kinds.end(), 2, Node::coordinates);
  kinds.insert(kinds.end(), joints, Node::joint);
  std::vector<QuasidefiniteFactor::Edge> edges;
  for (std::size_t j = 0; j < joints; ++j)
    for (const std::size_t node : {j, bodies, bodies + 1})
      edges.push_back({static_cast<Index>(first + j), static_cast<Index>(node)});
  QuasidefiniteFactor factor;
  factor.analyse(kinds, edges);
  factor.clear();
  Vector dense(m * m, 0.0);
  for (std::size_t k = 0; k < m; ++k) dense[(m + 1) * k] = k < 6 * first ? 1 : k % 6 < rows ? 0 : -1;
  for (std::size_t j = 0; j < joints; ++j)
    for (std::size_t k = 0; k < rows; ++k) factor.diagonal(first + j)[7 * k] = 0;
  small::Random random(3);
  for (std::size_t e = 0; e < edges.size(); ++e)
    for (std::size_t c = 0; c < 6; ++c) {
      const bool light = e % 3 == 0;
      double sum = 0;
      for (std::size_t r = 0; r < rows; ++r) {
        const double value = light && r == rows - 1 ? sum : (light ? 300 : 1) * random.normal();
        sum += value;
        const std::size_t row = 6 * edges[e].a + r, column = 6 * edges[e].b + c;
        dense[m * row + column] = dense[m * column + row] = value;
        factor.block(e)[factor.a_first(e) ? 6 * r + c : 6 * c + r] = value;
      }
    }
  CHECK(factor.factor());
  const Vector r = random.vector(m), expected = solve_dense(dense, r);
  Vector z(m);
  const auto place = [&](std::size_t node) { return 6 * static_cast<std::size_t>(factor.position(node)); };
  for (std::size_t i = 0; i < kinds.size(); ++i) std::copy_n(&r[6 * i], 6, &z[place(i)]);
  factor.forward(z.data());
  factor.backward(z.data());
  for (std::size_t i = 0; i < kinds.size(); ++i)
    for (std::size_t k = 0; k < 6; ++k)
      CHECK_NEAR(z[place(i) + k], expected[6 * i + k], 1e-9 * largest(expected));
}

// Breaks when the order fills a tree in: the work on a chain of n bodies must be linear in n.
TEST(trees_take_linear_work) {
  const auto work = [](Index bodies) {
    std::vector<QuasidefiniteFactor::Edge> joints;
    for (Index i = 1; i < bodies; ++i) joints.push_back({i, (i - 1) / 2});
    return BlockSystem(static_cast<std::size_t>(bodies), joints, 0.1).factor.work();
  };
  CHECK_NEAR(work(41) - work(21), 2 * (work(21) - work(11)), 1e-9);
}

// W and q by their definition, from the dense A: with the bilateral rows f and the others c,
//   W = A_cc - A_cf A_ff^-1 A_fc,   q = b_c - A_cf A_ff^-1 b_f.
// Breaks when a column of Y misses a node on its way, a sign is wrong, or islands share rows. The tolerance
// is that of the least compliance, 1e-13 of the diagonal, times the condition of A_ff.
TEST(reduction_is_the_schur_complement) {
  for (const small::Case& c : mechanisms()) {
    Reduction reduction;
    CHECK(reduction.analyse(c.problem, 1000) && reduction.factor(c.problem));
    const std::size_t m = c.problem.rows();
    const Vector A = small::dense_matrix(c.problem.A);
    const std::vector<std::size_t>& f = reduction.mechanism().rows();
    const auto schur = [&](auto&& right) {  // A_ff^-1 right
      Vector A_ff, r;
      for (std::size_t i : f) {
        for (std::size_t j : f) A_ff.push_back(A[m * i + j]);
        r.push_back(right(i));
      }
      return solve_dense(A_ff, r);
    };
    const Vector y = schur([&](std::size_t i) { return c.problem.b[i]; });
    for (std::size_t k = 0; k < reduction.islands(); ++k) {
      Reduction::Island& island = reduction.island(k);
      if (!island.thin.empty()) small::fill(island.thin, island.W);
      for (std::size_t j = 0; j < island.rows(); ++j) {
        const Vector column = schur([&](std::size_t i) { return A[m * i + island.row[j]]; });
        double q = c.problem.b[island.row[j]];
        for (std::size_t i = 0; i < f.size(); ++i) q -= A[m * f[i] + island.row[j]] * y[i];
        CHECK_NEAR(island.q[j], q, 1e-6);
        for (std::size_t i = 0; i < island.rows(); ++i) {
          double w = A[m * island.row[i] + island.row[j]];
          for (std::size_t l = 0; l < f.size(); ++l) w -= A[m * island.row[i] + f[l]] * column[l];
          CHECK_NEAR(island.W[island.rows() * i + j], w, 1e-6 * largest(A));
        }
      }
    }
  }
}

// Velocities at a solution are unique under the associated law, and under coulomb on these problems. Breaks
// when what is solved is not the problem: joints, contacts and limits must see what a method on the whole
// finds, and the residual that is told must be that of x.
TEST(elimination_solves_the_same_problem) {
  for (const small::Case& c : mechanisms())
    for (Law law : {Law::associated, Law::coulomb}) {
      Options options;
      options.law = law;
      options.tolerance = 1e-10;
      Elimination memory;  // as in a step: a problem by itself might go another way
      const Solution direct = automatic(c.problem, options, small::no_limit, memory);
      const bool linear = c.problem.K.all_bilateral();
      const Solution whole = solve(c.problem, linear ? "cg" : "newton", options);
      if (direct.status != Status::converged || direct.method != "elimination")
        check::fail(__FILE__, __LINE__, c.name + " is not eliminated");
      CHECK_NEAR(direct.residual, residual(c.problem, law, direct.x), 1e-14);
      if (whole.status == Status::converged)
        CHECK_NEAR(largest_difference(direct.u, whole.u), 0, 1e-7 * largest(c.problem.b));
    }
}

// Breaks when a direct solve that gave up, here for want of iterations, is not known as one, or when a solved
// one is: the methods after it would then be left out, or run for rounding.
TEST(a_direct_solve_knows_that_it_fell_short) {
  std::size_t short_of = 0;
  for (const small::Case& c : mechanisms())
    for (Law law : {Law::associated, Law::coulomb}) {
      Elimination memory;
      Options options;
      options.law = law;
      options.max_iterations = 1;
      Solution s;
      CHECK(memory.solve(c.problem, options, small::no_limit, s));
      CHECK(memory.fell_short() == (s.status != Status::converged));
      short_of += memory.fell_short();
    }
  CHECK(short_of > 0);
}

// Two links on a ball joint with twelve contacts each, of the ground and between them, that stick easily:
// more contacts than freedoms, and several solutions. Breaks when only Newton steps are tried, which solve 54
// of these.
TEST(contacts_that_jam_are_solved) {
  int solved = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    small::Random random(seed);
    ContactSystem A;
    SetProduct K;
    for (Index body : {0, 1}) {
      small::add_body(A, 0.3, {1e-3, 2e-3, 1e-3});
      for (int i = 0; i < 12; ++i) {
        const Vec3 n{random.normal(), random.normal(), 1 + std::abs(random.normal())};
        const Vec3 arm{0.1 * random.normal(), 0.1 * random.normal(), 0.1 * random.normal()};
        A.contacts.push_back(
            contact_between(body, i < 8 ? -1 : 1 - body, arm, {0, 0, 0.1}, (1 / norm(n)) * n));
        A.contact_compliance.push_back(0);
        K.append(Friction{4.0});
      }
    }
    small::add_ball_joint(A, 0, 1, {0, 0, -0.1}, {0, 0, 0.1}, 0);
    K.add_count<Bilateral>(3);
    Vector b = small::row_velocities(A.stored(), random.vector(12));
    const Problem p = make_problem(std::move(A), std::move(b), std::move(K));
    Options options;
    options.law = Law::coulomb;
    Elimination memory;
    Solution s;
    CHECK(memory.solve(p, options, small::no_limit, s));
    solved += s.status == Status::converged;
  }
  CHECK(solved >= 95);
}

// Joints that dry friction holds where they touch their limits, with gaps of up to 1e-7: no velocity is zero
// for the friction and closes the gap, so that the two faces contradict each other. Breaks when Newton's
// steps share the force between them freely: then 38 of these islands take more than 8 factorisations.
TEST(friction_that_holds_a_joint_at_its_limit) {
  int hard = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) {
    small::Random random(seed);
    ContactSystem A;
    SetProduct K;
    Vector held;  // by friction; limits carry nothing
    for (Index i = 0; i < 2; ++i) {
      small::add_body(A, 1, {1, 1, 1});
      for (int k = 0; k < 4; ++k) {
        JacobianRow row{i, i - 1, {}, {}};
        for (double& r : row.a) r = random.normal();
        if (i > 0)
          for (double& r : row.b) r = random.normal();
        A.jacobian.insert(A.jacobian.end(), 2, row);
        A.compliance.insert(A.compliance.end(), 2, 0.0);
        K.add_each<Interval>(Vector{-1}, Vector{1});
        K.add_count<NonNegative>(1);
        held.insert(held.end(), {random.uniform(-0.9, 0.9), 0.0});
      }
    }
    // What these impulses stop, and a load that has changed since.
    Vector b(A.rows());
    A.product(held, b);
    const Vector load = small::row_velocities(A, random.vector(12));
    for (std::size_t i = 0; i < b.size(); ++i)
      b[i] = 0.01 * load[i] - b[i] + (i % 2 ? 1e-7 * random.uniform(0, 1) : 0);
    const Problem p = make_problem(std::move(A), std::move(b), std::move(K));
    Options options;
    options.x0 = held;
    Elimination memory;
    Solution s;
    CHECK(memory.solve(p, options, small::no_limit, s));
    CHECK(s.status == Status::converged);
    hard += s.factorizations > 8;
  }
  CHECK(hard <= 16);
}

// A rope that runs over bodies of very different mass: an auxiliary body of 1e-7 of the others, whose rows
// have no compliance. Breaks when the rounding of W is taken for the answer.
TEST(light_bodies_between_heavy_ones) {
  ContactSystem A;
  for (double mass : {1.0, 1e-7, 1.0, 1e3}) small::add_body(A, mass, {0.1 * mass, 0.1 * mass, 0.1 * mass});
  for (Index i : {0, 2, 3}) {
    JacobianRow row{i, 1, {0, 0, 1, 0.1, 0, 0}, {}};
    row.b[i] = -1;
    A.jacobian.push_back(row);
    A.compliance.push_back(0);
    A.contacts.push_back(contact_between(i, -1, {0.1, 0, -0.2}, {0, 0, 0}, {0, 0, 1}));
    A.contact_compliance.push_back(0);
  }
  SetProduct K;
  K.add_each<Friction>(Vector{0.5, 0.5, 0.5});
  K.add_count<Bilateral>(3);
  const Problem p =
      make_problem(std::move(A), {-1, 0.3, 0, -1, 0, 0.2, -1, 0.1, 0, 0.01, 0.02, -0.01}, std::move(K));
  for (Law law : {Law::associated, Law::coulomb}) {
    Options options;
    options.law = law;
    options.tolerance = 1e-9;
    Elimination memory;
    const Solution s = automatic(p, options, small::no_limit, memory);
    CHECK(s.status == Status::converged && s.method == "elimination");
  }
}

// Breaks when bilateral rows that contradict each other are believed to be solved instead of being left to
// the methods for linear systems, and when rows that say the same twice are refused.
TEST(contradictory_bilateral_rows) {
  const Problem consistent = small::chain(4, false, true);
  CHECK(solve(consistent, "auto", {}).status == Status::converged);
  Problem contradictory = consistent;
  contradictory.b.back() += 1;
  const Solution none = solve(contradictory, "auto", {});
  CHECK(none.status != Status::converged && none.residual > 1e-3 && none.method != "elimination");
}

// Memory of one problem must not tell on another: a pattern that changes is analysed anew. Breaks when the
// analysis is kept for another mechanism, or a result depends on what was solved before.
TEST(memory_of_elimination_does_not_tell) {
  Elimination memory;
  const std::vector<small::Case> cases = mechanisms();
  for (int round = 0; round < 2; ++round)
    for (const small::Case& c : cases) {
      Elimination fresh;
      Solution a, b;
      CHECK(memory.solve(c.problem, {}, small::no_limit, a) &&
            fresh.solve(c.problem, {}, small::no_limit, b));
      CHECK(a.x == b.x && a.residual == b.residual);
    }
}

// Breaks when elimination is tried where it does not apply.
TEST(elimination_knows_its_limits) {
  Elimination memory;
  Solution s;
  CHECK(!memory.solve(small::as_callback(small::stack(2)), {}, small::no_limit, s));
  CHECK(!memory.solve(small::stack(40), {}, small::no_limit, s));  // 480 rows that touch each other
  CHECK(solve(small::stack(40), "auto", {}).status == Status::converged);
}

namespace {

// A chain hangs from a stack of many boxes: contacts are too many for dense matrices.
Problem chain_on_boxes() {
  const Problem boxes = small::stack(40);
  ContactSystem A = std::get<ContactSystem>(boxes.A);
  for (Index i = 0; i < 12; ++i) {
    small::add_body(A, 1, {0.01, 0.02, 0.02});
    small::add_ball_joint(A, 40 + i, i == 0 ? 39 : 39 + i, {-0.2, 0, 0}, {0.2, 0, 0}, 1e-7);
  }
  SetProduct K = boxes.K;
  K.add_count<Bilateral>(36);
  Vector b = boxes.b;
  for (int i = 0; i < 36; ++i) b.push_back(0.1 + 0.01 * i);
  return make_problem(std::move(A), std::move(b), std::move(K));
}

}  // namespace

// A solve that stops after five iterations. Breaks when bilateral rows are left where a first-order method
// had them, 1e-2 of their velocities and more; or when impulses are as large as an early iterate makes them,
// so that what comes together is driven apart: <x, u> over the contacts is none but for rounding then.
TEST(joints_hold_at_any_limit) {
  const Problem p = chain_on_boxes();
  const std::size_t first = p.rows() - 36;
  for (Law law : {Law::associated, Law::coulomb})
    for (std::size_t limit : {1, 5}) {
      Options options;
      options.law = law;
      options.max_iterations = limit;
      const Solution s = solve(p, "auto", options);
      CHECK(s.status != Status::converged);
      double power = 0, size = 0;
      for (std::size_t i = 0; i < first; ++i) {
        power += s.x[i] * s.u[i];
        size += std::abs(s.x[i] * s.u[i]);
      }
      CHECK(power <= 1e-9 * size);
      for (std::size_t i = first; i < p.rows(); ++i) CHECK_NEAR(s.u[i], 0, 1e-10);
    }
}

// What bilateral rows leave, as an operator, against the Schur complement that Reduction forms (above: by its
// definition): plain and fused products, and the u of zero impulses. Breaks when a body that joints hold
// moves by its own mass in one of them, or a copy of its line keeps the velocity that it had.
TEST(constrained_products) {
  for (const small::Case& c : mechanisms()) {
    ConstrainedProblem constrained;
    if (!constrained.make(c.problem, Law::associated)) continue;
    const Problem& rest = constrained.rest();
    Reduction reduction;
    CHECK(reduction.analyse(c.problem, 1000) && reduction.factor(c.problem));
    small::Random random(3);
    Vector x(c.problem.rows()), u(c.problem.rows()), kept, found(rest.rows()), seen(rest.rows());
    for (double& v : x) v = random.uniform(0, 1);
    project(c.problem.K, x, x);
    for (std::size_t k = 0; k < reduction.islands(); ++k) {
      Reduction::Island& island = reduction.island(k);
      if (!island.thin.empty()) small::fill(island.thin, island.W);
      for (std::size_t i = 0; i < island.rows(); ++i) {
        double& to = u[island.row[i]];
        to = island.q[i];
        for (std::size_t j = 0; j < island.rows(); ++j)
          to += island.W[island.rows() * i + j] * x[island.row[j]];
      }
    }
    constrained.restrict_to_rest(u, kept);
    Vector start;
    constrained.restrict_to_rest(x, start);
    product(rest.A, start, found);
    for (std::size_t i = 0; i < found.size(); ++i)
      CHECK_NEAR(found[i] + rest.b[i], kept[i], 1e-8 * largest(kept));
    ContactIterate iterate(rest, Law::associated, 1);
    iterate.start(start);
    iterate.extract(start, seen);
    CHECK_NEAR(largest_difference(seen, kept), 0, 1e-8 * largest(kept));
  }
}

// Breaks when first-order methods on what bilateral rows leave solve another problem: residuals are those of
// the whole, joints included, and velocities those of a method on the whole.
TEST(constrained_runs_solve_the_whole) {
  for (const small::Case& c :
       {small::Case{"chain on boxes", chain_on_boxes()}, small::Case{"loop", walker(true, false, 1e-9)}})
    for (Law law : {Law::associated, Law::coulomb}) {
      if (check::sanitized && law != Law::coulomb) continue;  // a tenth of the time of all tests
      Options options;
      options.law = law;
      options.tolerance = 1e-6;
      const Solution whole = solve(c.problem, "newton", options);
      for (Starter starter : {start_apgd, start_spg}) {
        ConstrainedProblem constrained;
        CHECK(constrained.make(c.problem, law));
        const Solution s = complete(constrained.start(starter, options, small::no_limit));
        CHECK(s.status == Status::converged && s.residual <= 1e-6);
        CHECK_NEAR(s.residual, residual(c.problem, law, s.x), 1e-14);
        if (whole.status == Status::converged)
          CHECK_NEAR(largest_difference(s.u, whole.u), 0, 1e-3 * largest(c.problem.b));
      }
    }
}

// Breaks when a solve that could use its own memory asks for more: a step of a simulation allocates nothing
// in the direct way, once its arrays are there.
TEST(elimination_keeps_its_memory) {
  Elimination memory;
  Solution s;
  const Problem p = walker(true, true, 1e-6);
  CHECK(memory.solve(p, {}, small::no_limit, s));
  const double *x = s.x.data(), *u = s.u.data();
  CHECK(memory.solve(p, {}, small::no_limit, s));
  CHECK(s.x.data() == x && s.u.data() == u);
}
