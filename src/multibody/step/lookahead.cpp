#include "multibody/step/lookahead.hpp"

#include <algorithm>
#include <type_traits>

#include "amontons/solvers/driver/driver.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/pose.hpp"
#include "multibody/step/rest.hpp"
#include "multibody/step/second_order.hpp"
#include "multibody/step/sleep.hpp"

namespace amontons {

static void find_velocities(const StepSetting& step, const Observed& o, const StepProblem& posed,
                            Solved& solved) {
  const Subset& visited = step.visited.bodies;
  solved.after.resize(o.free.size());
  visited.each(o.free.size(), [&](std::size_t i) { solved.after[i] = o.free[i]; });
  // If all stops, impulses are not needed.
  if (!solved.islands.all_rest()) apply_impulses(*posed.problem, solved.solution.x, solved.after, visited);
  stop_resting(step.model, posed.problem->graph.islands, solved.islands, visited, solved.after);
  stop_asleep(step.asleep, visited, solved.after);
}

void solve(const StepSetting& step, const StepSolver& solver, const Observed& o, const StepProblem& posed,
           Solved& solved) {
  find_rest(step, o, posed, solver, solved.solution, solved.islands);
  solve_beside(solver, posed, step.asleep, solved);
  find_velocities(step, o, posed, solved);
  solver.clock.lap(&Timings::solve);
}

// Adds what the solved velocities lead to. Turns follow the velocities once (`first`), and again with new
// contacts. Returns whether the problem changed.
static bool add_unforeseen(const StepSetting& step, StepClock& clock, bool first, Observed& o,
                           StepProblem& posed, const Solved& solved) {
  const Reach reach = step.reach(o.frames, solved.after);
  const std::size_t known = o.contacts.size();
  step.finder.find_unforeseen(reach, o.contacts);
  clock.lap(&Timings::collision);
  const bool found = o.contacts.size() > known;
  const bool turning = !posed.turns.empty() && (found || first);
  if (found) take_in(solved, known, o, posed);
  const bool turned = turning && find_turns(reach, least_turn(step), o.contacts, step.finder, posed.turns);
  if (found || turned) write_b(o, posed);
  clock.lap(&Timings::assembly);
  if (!found && turned) posed.begin_at(solved);
  return found || turned;
}

void look_ahead(const StepSetting& step, const StepSolver& solver, Observed& o, StepProblem& posed,
                Solved& solved) {
  for (int round = 0;
       round < step::policy.most_looks && !solver.budget.ends_within(solver.clock.timings.collision);
       ++round) {
    if (!add_unforeseen(step, solver.clock, round == 0, o, posed, solved)) return;
    solve(step, solver, o, posed, solved);
  }
}

// Per island: whether it has a loop of rows and is a system of few linear equations, which moves.
static std::vector<unsigned char> find_loops(const StepSetting& step, const Observed& o,
                                             const Problem& problem, const StepIslands& islands) {
  const Islands& graph = problem.graph.islands;
  std::vector<unsigned char> loops(graph.count, 0);
  const auto set_home = [&](Index body, unsigned char value) {
    if (const Index home = body < 0 ? -1 : graph.of_body[body]; home >= 0) loops[home] = value;
  };
  for (const Index j : step.tree.loops_of_rows()) {
    set_home(o.joints[j].body_a, 1);
    set_home(o.joints[j].body_b, 1);
  }
  for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t) {
    if (const Index home = graph.of_block[block];
        !std::is_same_v<S, Bilateral> || (islands.any_rests && islands.each[home].rests))
      loops[home] = 0;
  });
  for (const TreeBody& b : step.tree.moving()) set_home(b.body, 0);
  std::vector<std::size_t> rows(graph.count, 0);
  for (const Index home : graph.of_block) rows[home] += 1;
  for (std::size_t home = 0; home < rows.size(); ++home)
    if (rows[home] > step::policy.few_rows) loops[home] = 0;
  return loops;
}

// The rows hold velocities in the pose at the start, docs/algorithm.md (9). In the pose at the end an error C
// of third order is left. Impulses along the same rows take it out: D v+ changes by -C / h. The step is then
// Verlet's with constraints. Joints stay closed, and energy has no drift: Leimkuhler and Skeel, "Symplectic
// numerical integrators in constrained Hamiltonian systems", J. Comput. Phys. 112, 1994. Displacements of
// the bodies would lose energy.
//
// Let all bars of a loop lie in one line in a pose ahead. The way to it is h w in the nearest step. An error
// C moves the bars apart by C / (h w), and their rates by C / (h^2 w).
//
// An island with contacts, limits or friction keeps its solution. Its motion is not smooth, and a second
// solve of inequalities costs as much as the first.
//
// The start of the second solve is zero. The impulses of the first solve it to within the tolerance, so that
// they would be accepted without the change.
void close_loops(const StepSetting& step, const StepSolver& solver, const State& state, Observed& o,
                 StepProblem& posed, Solved& solved) {
  if (step.tree.loops_of_rows().empty() || step.damped || step.options.recovery != Recovery::projection ||
      solved.solution.status != Status::converged)
    return;
  const Problem& problem = *posed.problem;
  const std::vector<Index>& home = problem.graph.islands.of_block;
  const std::vector<unsigned char> loops = find_loops(step, o, problem, solved.islands);
  Part part;
  for (std::size_t k = 0; k < home.size(); ++k)
    if (loops[home[k]]) part.blocks.push_back(k);
  if (part.blocks.empty()) return;
  // Rows of joints come last, and each is a block.
  const std::size_t first = home.size() - posed.rows.tags.size();
  const auto counts = [&](std::size_t i) { return loops[home[first + i]] != 0; };
  const std::vector<double> c = posed.rows.c;
  close_joints({step.model, o.frames, o.joints, solved.after, step.h}, state, counts, posed.rows);
  write_b(o, posed);
  std::vector<Index> number;
  part.make(problem, {}, number);
  part.solution = solve_step(solver, part.of.problem, {});
  // A solve that a budget ends keeps the first one.
  if (part.solution.status != Status::converged) {
    posed.rows.c = c;
    return write_b(o, posed);
  }
  solved.solution.residual = std::max(solved.solution.residual, part.solution.residual);
  part.of.put(part.solution.x, solved.solution.x);
  form_velocities(problem, solved.solution);
  find_velocities(step, o, posed, solved);
  solver.clock.lap(&Timings::solve);
}

}  // namespace amontons
