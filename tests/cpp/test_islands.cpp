// Islands: solving what is not connected apart must not change the answer.
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "amontons/base/budget.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "amontons/problem/island_part.hpp"
#include "amontons/problem/linkage.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/solvers/choice/automatic.hpp"
#include "amontons/solvers/choice/islands.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
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

// A stack of boxes, then three trees of a box and two boxes that hang on it by hinges, each tree on the
// same floor. The last hinges have limits that hold: rows along a coordinate. `on_top`: the first tree stands
// on the stack.
Problem pendulums_beside_a_stack(int levels = 3, bool on_top = false) {
  ModelDescription d;
  d.trees = Trees::automatic;
  Geom floor;
  floor.shape = Plane{};
  d.geoms.push_back(floor);
  const auto add_box = [&](const Vec3& position) {
    Body body;
    body.mass = 1 + 0.1 * static_cast<double>(d.bodies.size());
    body.inertia = Mat3::diagonal(body.mass / 6, body.mass / 6, body.mass / 6);
    body.pose.position = position;
    body.linear_velocity = {0.2, 0.1, 0};
    Geom geom;
    geom.body = static_cast<Index>(d.bodies.size());
    geom.shape = Box{{0.5, 0.5, 0.5}};
    d.geoms.push_back(geom);
    d.bodies.push_back(body);
    return geom.body;
  };
  for (int level = 0; level < levels; ++level) add_box({0.1 * level, 0, 0.5 + level});
  for (int tree = 1; tree <= 3; ++tree) {
    const bool lifted = on_top && tree == 1;
    const Vec3 base{lifted ? 0.1 * levels : 10.0 * tree, 0, lifted ? 0.5 + levels : 0.5};
    Index above = add_box(base);
    for (int link = 1; link <= 2; ++link) {
      const Index body = add_box(base + Vec3{1.2 * link, 0, 0});
      Joint hinge;
      hinge.body_a = above;
      hinge.body_b = body;
      hinge.frame_a.position = {0.6, 0, 0};
      hinge.frame_b.position = {-0.6, 0, 0};
      hinge.dofs.emplace_back();
      hinge.dofs[0].axis = {0, 1, 0};
      if (link == 2) hinge.dofs[0].lower = 0;
      d.joints.push_back(hinge);
      above = body;
    }
  }
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

// Fails if a part of a scene with trees has another A, loses a coordinate or a link, or has trees although
// its bodies are free: factors then are not available to a pile beside a robot.
TEST(islands_keep_their_trees) {
  const Problem problem = pendulums_beside_a_stack();
  const auto& A = std::get<ContactSystem>(problem.A);
  const Islands& islands = problem.graph.islands;
  CHECK(islands.count == 4);
  const small::Vector whole = small::dense_matrix(problem.A);
  std::vector<Index> scratch;
  IslandPart part;  // one memory for all
  std::size_t with_trees = 0;
  for (std::size_t i = 0; i < islands.count; ++i) {
    std::vector<std::size_t> members;
    for (std::size_t k = 0; k < islands.of_block.size(); ++k)
      if (islands.of_block[k] == static_cast<Index>(i)) members.push_back(k);
    extract(problem, members, scratch, part);
    const auto& own = std::get<ContactSystem>(part.problem.A);
    const small::Vector entries = small::dense_matrix(part.problem.A);
    const std::size_t m = part.rows.size();
    for (std::size_t r = 0; r < m; ++r)
      for (std::size_t c = 0; c < m; ++c)
        CHECK_NEAR(entries[r * m + c], whole[part.rows[r] * problem.rows() + part.rows[c]], 1e-12);
    CHECK(part.problem.graph.islands.count == 1);
    CHECK(own.bodies.size() == part.bodies.size() && own.bodies.size() <= 3);
    CHECK(has_trees(part.problem) == (part.bodies[0] != 0));
    if (!has_trees(part.problem)) continue;
    ++with_trees;
    CHECK(own.constrained->linkage->coordinates() < A.constrained->linkage->coordinates());
    CHECK(own.half.whole);
    ContactSystem again = own;  // the rows of D M^-1/2 follow from the linkage of the part
    again.renew();
    CHECK(again.half.coordinate == own.half.coordinate && again.half.value == own.half.value);
  }
  CHECK(with_trees == 3);
  Options options;
  options.law = Law::associated;
  options.tolerance = 1e-10;
  const Solution all = interior_point(problem, options, small::no_limit);
  const Solution parts = solve_by_islands(problem, options, small::no_limit, automatic);
  CHECK(all.status == Status::converged && parts.status == Status::converged);
  CHECK(parts.reason.find("2 groups of islands") != std::string::npos);
  CHECK(residual(problem, Law::associated, parts.x) <= 1e-10);
  for (std::size_t i = 0; i < all.u.size(); ++i) CHECK_NEAR(all.u[i], parts.u[i], 1e-7);
}

// Fails if a tree makes the matrix of an island dense: that of the dense A, or that of a factor with fill
// between all bodies. One tree stands on a stack of ten boxes; L has blocks of neighbours in the stack, and
// of the tree, alone.
TEST(trees_keep_factors_sparse) {
  const Problem problem = pendulums_beside_a_stack(10, true);
  CHECK(problem.graph.islands.count == 3 && problem.rows() > 180);
  const ShiftedSystem sparse(problem);
  CHECK(sparse.in_body_space());
  CHECK(sparse.factor_entries() < 22 * 36 + 3 * 64);
  Options options;
  options.law = Law::associated;
  options.tolerance = 1e-10;
  const Solution s = interior_point(problem, options, small::no_limit);
  const Solution dense = interior_point(as_matrix(problem), options, small::no_limit);
  CHECK(s.status == Status::converged && dense.status == Status::converged);
  CHECK(s.factorizations <= dense.factorizations + 2);
  for (std::size_t i = 0; i < s.u.size(); ++i) CHECK_NEAR(s.u[i], dense.u[i], 1e-7);
}

// Fails if the direct way takes a pile beside a tree whose rows it would not take without one: its
// coordinates are few enough, but their matrix would be dense.
TEST(a_pile_beside_trees_is_a_pile) {
  const auto is_direct = [](int levels, bool on_top) {
    Elimination elimination;
    Solution s;
    return solve_directly(pendulums_beside_a_stack(levels, on_top), {}, small::no_limit, elimination, s);
  };
  CHECK(is_direct(3, false));
  CHECK(!is_direct(20, false));
  CHECK(is_direct(20, true));  // one mechanism: its coordinates count
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
