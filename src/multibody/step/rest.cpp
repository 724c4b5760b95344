// An island at rest has the same problem in each step, and the impulses of the last step solve it. The
// residual r of an island bounds the velocity errors of its bodies together. The natural map of a block with
// p, the mean of its diag(A), is the energy norm of its velocity error: v^2 / p. That of zero impulses is n
// (g h)^2 / p for n equal bodies at rest. So velocities in contacts are off by about r g h. Those of a body
// add up along the contacts that carry it: with k independent errors v^2 is k (r g h)^2. An island rests if
// the sum of v^2 over its bodies is at most that of such errors. Each body alone may be off by the error of
// all. If each of n might, a heap of 3000 spheres would stop while it falls, at a tolerance of 0.1.
//
// A body that stops loses its velocity, and with it momentum. The scene as a whole may lose the error of a
// start within the tolerance; if it did not, the errors of starts would add up. Beside other bodies that
// move, momentum is kept to the rounding of a direct solve: the impulses of islands that iterations solve
// change until they carry all loads (step/carry).
//
// Islands are found only if some contact has slow bodies on both sides. Each test is made only if an island
// may still rest. So a robot that walks pays for one look at its velocities. Islands that move become a
// problem of their own, because the direct way and iterations work on all rows of a problem. A is block
// diagonal over islands, so that leaving some out is exact (choice/islands.hpp).
#include "multibody/step/rest.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/start.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/carry.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/solve_step.hpp"

namespace amontons {

namespace {

// Whether an island still counts as resting.
bool rests_any(const StepIslands& islands) {
  return std::any_of(islands.each.begin(), islands.each.end(), [](const Island& i) { return i.rests; });
}

double squared_speed(const BodyVelocity& v, double length) {
  return norm_squared(v.linear) + length * length * norm_squared(v.angular);
}

// How many contacts or joints carry each body above what impulses do not move, at least; 1 if none does.
const std::vector<double>& find_heights(const ContactGraph& graph) {
  static thread_local std::vector<double> height;  // kept: a step allocates nothing
  const auto unknown = static_cast<double>(graph.bodies() + 1);
  height.assign(graph.bodies(), unknown);
  for (bool changed = true; changed;) {
    changed = false;
    const auto rise = [&](Index above, double below) {
      if (above < 0 || !(height[above] > below + 1)) return;
      height[above] = below + 1;
      changed = true;
    };
    for (const auto& [a, b] : graph.links) {
      rise(a, b < 0 ? 0 : height[b]);
      rise(b, a < 0 ? 0 : height[a]);
    }
  }
  std::replace(height.begin(), height.end(), unknown, 1.0);
  return height;
}

// Islands whose bodies together move by more than this error do not rest. Bodies that impulses do not move
// have no island, and need none. A box on a conveyor moves with it. A box that is held above a conveyor
// slides on it for ever with the same impulses. The velocity of the conveyor is in b, and so in the residual
// of the start, which is what counts.
void keep_slow(double length, const BodyVelocities& v, const Subset& visited, double error,
               const Islands& graph, std::vector<Island>& each) {
  for (Island& island : each) island.motion = 0;
  visited.each(v.size(), [&](std::size_t i) {
    if (const Index home = graph.of_body[i]; home >= 0) each[home].motion += squared_speed(v[i], length);
  });
  for (Island& island : each) island.rests = island.rests && island.motion <= error * error * island.allowed;
}

// Islands whose start is not within the tolerance do not rest.
void keep_solved(const Problem& problem, Law law, double tolerance, const Solution& start,
                 StepIslands& islands) {
  for (Island& i : islands.each) i.start = {};
  for_each_block(problem.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    Island& island = islands.each[problem.graph.islands.of_block[block]];
    if (!island.rests) return;
    const double zero[S::dim] = {};
    double g[S::dim];
    add_de_saxce_term(set, law, &start.u[row], g);
    island.start.map += natural_map_squared(set, problem.P[block], &start.x[row], g);
    add_de_saxce_term(set, law, &problem.b[row], g);
    island.start.at_zero += natural_map_squared(set, problem.P[block], zero, g);
  });
  for (Island& i : islands.each) i.rests = i.rests && i.start.residual() <= tolerance;
}

// Beside bodies that move only islands whose impulses carry all loads to rounding rest. Those of the others
// are changed until they do, if the island can stand.
void keep_carried(const StepSetting& step, std::span<const Contact> contacts, const StepProblem& posed,
                  const StepSolver& solver, Solution& start, StepIslands& islands) {
  const double length = step.model.length(), share = step::policy.direct_start;
  const double rounding = share * step.options.tolerance;
  const Problem& problem = *posed.problem;
  const BodyVelocities& predicted = posed.predicted;
  const Islands& graph = problem.graph.islands;
  std::vector<Island> carried = islands.each;
  keep_slow(length, predicted, step.visited.bodies, rounding, graph, carried);
  const auto counts = [&](Index home) { return islands.each[home].rests && !carried[home].rests; };
  bool any = false;
  for (Index home = 0; home < static_cast<Index>(graph.count); ++home) {
    islands.each[home].changed = islands.each[home].changed || counts(home);
    any = any || counts(home);
  }
  if (!any) return;
  Options options = solver.options();
  options.tolerance = share * rounding;
  options.iterates = nullptr;
  const Part part = find_carrying({problem, contacts, start.x}, predicted, counts, options, solver.budget);
  solver.sums.add_cost(part.solution);
  std::vector<double> change(problem.rows(), 0.0);
  for (std::size_t k = 0; k < part.solution.x.size(); ++k)
    change[part.of.rows[k]] = part.solution.x[k] - start.x[part.of.rows[k]];
  BodyVelocities after = predicted;
  apply_impulses(problem, change, after, step.visited.bodies);
  keep_slow(length, after, step.visited.bodies, rounding, graph, islands.each);
  if (part.blocks.empty()) return;
  part.of.put(part.solution.x, start.x);
  form_velocities(problem, start);
  keep_solved(problem, step.options.law, step.options.tolerance, start, islands);
}

}  // namespace

double SquaredMaps::residual() const {
  constexpr double least = 1e-300;  // not tuned: above zero
  return std::sqrt(map) / std::max(std::sqrt(at_zero), least);
}

// The islands at rest; false if there is none, even asleep. The velocities at the start may be as large as
// the error of a start within the tolerance: the impulses of this step take them out. Those after them may
// not, unless all rests, because the bodies lose what remains.
static bool find_islands_at_rest(const StepSetting& step, const Observed& o, const StepProblem& posed,
                                 const StepSolver& solver, Solution& start, StepIslands& islands) {
  const Model& model = step.model;
  const double tolerance = step.options.tolerance, fall = step.fall();
  const double of_one = tolerance * tolerance * fall * fall;
  const auto is_slow = [&](const BodyVelocity& v, double most) {
    return squared_speed(v, model.length()) <= most;
  };
  // One of n bodies may have the error of all.
  const double of_all = static_cast<double>(model.bodies()) * of_one;
  const auto slow_at = [&](Index body) { return body < 0 || is_slow(o.start[body], of_all); };
  const auto may_rest = [&](const Contact& c) { return slow_at(c.body_a) && slow_at(c.body_b); };
  const bool some = step.asleep.any();
  if (!some && std::none_of(o.contacts.begin(), o.contacts.end(), may_rest)) return false;
  const Problem& problem = *posed.problem;
  const Islands& graph = problem.graph.islands;
  islands.each.assign(graph.count, {});
  for (Island& island : islands.each) {
    island.rests = true;
    island.changed = posed.again;
  }
  const std::vector<double>& height = find_heights(problem.graph);
  const Subset& visited = step.visited.bodies;
  visited.each(model.bodies(), [&](std::size_t i) {
    if (const Index home = graph.of_body[i]; home >= 0) islands.each[home].allowed += height[i] * fall * fall;
  });
  // Before the step, and with the start.
  islands.slow = true;
  for (const BodyVelocities* v : {&o.start, &posed.predicted}) {
    visited.each(v->size(), [&](std::size_t i) {
      islands.slow = islands.slow && (graph.of_body[i] >= 0 || is_slow((*v)[i], of_one));
    });
    keep_slow(model.length(), *v, visited, tolerance, graph, islands.each);
    if (!some && !rests_any(islands)) return false;
  }
  begin_at(problem, posed.x0, start);
  keep_solved(problem, step.options.law, tolerance, start, islands);
  const auto rests = [](const Island& i) { return i.rests; };
  islands.slow = islands.slow && std::all_of(islands.each.begin(), islands.each.end(), rests);
  if (!islands.slow && !step.options.own_method)
    keep_carried(step, o.contacts, posed, solver, start, islands);
  return some || rests_any(islands);
}

void find_rest(const StepSetting& step, const Observed& o, const StepProblem& posed, const StepSolver& solver,
               Solution& start, StepIslands& islands) {
  const Problem& problem = *posed.problem;
  Part& moving = islands.moving;
  // Without new contacts the islands that rested beside an earlier solve of the step still do: contacts that
  // turn change b alone, and none turns where all rest.
  if (posed.again && islands.any_rests && !moving.blocks.empty() && start.x.size() == problem.rows()) {
    moving.begin_at(posed.x0);
    return moving.of.take(problem.b, moving.of.problem.b);
  }
  islands.any_rests = false;
  moving.blocks.clear();
  // Where all that touches something sleeps, all rests: no solve sees a row. The result is that of a step in
  // which these islands rest: an accepted start. Zero impulses would be added to free velocities otherwise,
  // and a zero would lose its sign.
  if (step.asleep.any() && problem.rows() == 0) {
    start.x.clear();
    start.u.clear();
    islands.each.clear();
    islands.slow = false;
    islands.any_rests = true;
    return;
  }
  // The same part of the problem is solved whether others rest or sleep: its bits depend on that.
  if (posed.x0.empty() || (o.contacts.empty() && !step.asleep.any()) ||
      !find_islands_at_rest(step, o, posed, solver, start, islands))
    return;
  const std::vector<Index>& home = problem.graph.islands.of_block;
  for (std::size_t k = 0; k < home.size(); ++k)
    if (!islands.each[home[k]].rests) moving.blocks.push_back(k);
  islands.any_rests = moving.blocks.empty() || !step.options.own_method;
  if (islands.any_rests && !moving.blocks.empty()) moving.make(problem, posed.x0, islands.number);
}

// Driven bodies keep their velocities, and so do those that touch nothing, which no solve can be wrong about.
void stop_resting(const Model& model, const Islands& graph, const StepIslands& islands, const Subset& visited,
                  BodyVelocities& v) {
  if (!islands.any_rests) return;
  const auto stops = [&](std::size_t i) {
    const Index home = graph.of_body[i];
    return home >= 0 && islands.each[home].rests;
  };
  visited.each(v.size(), [&](std::size_t i) {
    if (stops(i) && model.is_dynamic(static_cast<Index>(i))) v[i] = {};
  });
}

}  // namespace amontons
