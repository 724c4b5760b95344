// Islands: solving what is not connected apart must not change the answer.
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "amontons/base/budget.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/solvers/choice/islands.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"
#include "problems.hpp"

using namespace amontons;

namespace {

// `stacks` stacks of three sliding boxes on one floor, the last of them joined to the world by a hinge: the
// floor does not move, so that it connects nothing.
Problem stacks_on_a_floor(int stacks) {
  ModelDescription d;
  const auto add_geom = [&](Index body, Shape shape) {
    Geom geom;
    geom.body = body;
    geom.shape = std::move(shape);
    d.geoms.push_back(geom);
  };
  add_geom(world, Plane{});
  for (int s = 0; s < stacks; ++s)
    for (int level = 0; level < 3; ++level) {
      Body body;
      body.mass = 1 + level + 0.1 * s;
      body.inertia = Mat3::diagonal(body.mass / 6, body.mass / 6, body.mass / 6);
      body.pose.position = {3.0 * s + 0.1 * level, 0, 0.5 + level};
      body.linear_velocity = {0.3 * s, 0.2 * level, 0};
      add_geom(static_cast<Index>(d.bodies.size()), Box{{0.5, 0.5, 0.5}});
      d.bodies.push_back(body);
    }
  Joint hinge;
  hinge.body_a = static_cast<Index>(d.bodies.size()) - 1;
  hinge.frame_b = d.bodies.back().pose;
  hinge.dofs.emplace_back();
  d.joints.push_back(hinge);
  Simulation sim(std::make_shared<Model>(d), {});
  sim.step();
  return *sim.problem();
}

// What each group of islands is given, in the order in which they are solved.
struct Share {
  std::size_t blocks;
  double work, time;
};
std::vector<Share> shares;

Solution note_the_share(const Problem& problem, const Options&, Budget& budget) {
  shares.push_back({problem.K.blocks(), budget.work_left(), budget.left()});
  Solution s;
  s.x.assign(problem.rows(), 0.0);
  return s;
}

}  // namespace

// A box on a hinge beside a large wall that is hard to solve. Fails if the few rows get time and work by
// their number only, which is too little for any solve, or come last, when nothing is left: they would then
// keep the impulses of their start, and what has just come to touch would pass through.
TEST(small_islands_get_enough) {
  const Problem problem = stacks_on_a_floor(40);
  shares.clear();
  Options options;
  options.law = Law::associated;
  constexpr double work = 1e9;
  Budget budget(100, work);
  solve_by_islands(problem, options, budget, note_the_share);
  CHECK(shares.size() > 2);
  CHECK(shares.front().blocks == 17);  // twelve contacts, five rows of the hinge
  CHECK(shares.front().blocks * 20 < problem.K.blocks());
  const double least = 0.5 / static_cast<double>(shares.size());
  CHECK(shares.front().work >= 0.99 * least * work && shares.front().time >= 0.9 * least * 100);
  for (std::size_t i = 1; i < shares.size(); ++i) CHECK(shares[i - 1].blocks <= shares[i].blocks);
  CHECK(shares.back().work >= 0.99 * work);  // nothing was spent
}

// Fails if a contact or row gets lost, bodies are numbered wrongly or an island keeps a body of another: the
// velocities of the two answers, which are unique, would differ by more than both tolerances allow.
TEST(islands_agree_with_the_whole) {
  for (int stacks : {1, 2, 40}) {
    const Problem problem = stacks_on_a_floor(stacks);
    CHECK(problem.K.blocks() == static_cast<std::size_t>(12 * stacks + 5));
    Options options;
    options.law = Law::associated;
    options.tolerance = 1e-10;
    const Solution whole = interior_point(problem, options, small::no_limit),
                   parts = solve_by_islands(problem, options, small::no_limit, interior_point);
    CHECK(whole.status == Status::converged && parts.status == Status::converged);
    CHECK(residual(problem, Law::associated, parts.x) <= 1e-10);
    double largest = 0;
    for (std::size_t i = 0; i < whole.u.size(); ++i)
      largest = std::max(largest, std::abs(whole.u[i] - parts.u[i]));
    CHECK_NEAR(largest, 0, 1e-7);
    CHECK((parts.reason.find("islands") != std::string::npos) == (stacks > 1));
  }
}

// Fails if a converged island is not one of the law asked for.
TEST(islands_keep_the_law) {
  const Problem problem = stacks_on_a_floor(40);
  Options options;
  options.law = Law::coulomb;
  options.tolerance = 1e-8;
  const Solution s = automatic(problem, options, small::no_limit);
  CHECK(s.status == Status::converged);
  CHECK(residual(problem, Law::coulomb, s.x) <= 1e-8);
  CHECK(residual(problem, Law::associated, s.x) > 1e-3);  // they slide: the laws differ
}

// Fails if a warm start is not handed to the islands row by row: from the solution there is nothing to
// iterate.
TEST(islands_start_warm) {
  const Problem problem = stacks_on_a_floor(40);
  Options options;
  options.law = Law::associated;
  options.tolerance = 1e-8;
  const Solution first = solve_by_islands(problem, options, small::no_limit, apgd);
  options.x0 = first.x;
  const Solution again = solve_by_islands(problem, options, small::no_limit, apgd);
  CHECK(first.iterations > 0 && again.iterations == 0);
  CHECK(again.status == Status::converged);
}
