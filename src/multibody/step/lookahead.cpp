#include "multibody/step/lookahead.hpp"

#include "multibody/step/policy.hpp"
#include "multibody/step/pose.hpp"
#include "multibody/step/second_order.hpp"
#include "multibody/step/sleep.hpp"

namespace amontons {

void solve(const StepSetting& step, const StepSolver& solver, const Observed& o, const StepProblem& posed,
           Solved& solved) {
  find_rest(step, o, {*posed.problem, posed.x0, posed.predicted, posed.again},
            {solver.options(), solver.budget, solver.sums}, solved.solution, solved.islands);
  solve_beside(solver, posed, step.asleep, solved);
  solved.after = o.free;
  // If all stops, impulses are not needed.
  if (!solved.islands.all_rest()) apply_impulses(*posed.problem, solved.solution.x, solved.after);
  stop_resting(step.model, posed.problem->graph.islands, solved.islands, solved.after);
  stop_asleep(step.asleep, solved.after);
  solver.clock.lap(&Timings::solve);
}

// Adds what the solved velocities lead to. Turns follow the velocities once (`first`), and again with new
// contacts. Returns whether the problem changed.
static bool add_unforeseen(const StepSetting& step, StepClock& clock, bool first, Observed& o,
                           StepProblem& posed, const Solved& solved) {
  const Reach reach{step.model,
                    o.frames,
                    solved.after,
                    step.h,
                    step.margin,
                    step.options.threads,
                    step.options.pairs.get(),
                    &step.asleep};
  const std::size_t known = o.contacts.size();
  step.finder.find_unforeseen(reach, o.contacts);
  clock.lap(&Timings::collision);
  const bool found = o.contacts.size() > known;
  const bool turning = !posed.turns.empty() && (found || first);
  if (found) take_in(solved, known, o, posed);
  const bool turned =
      turning && find_turns(reach, o.free, turns_of(step), o.contacts, step.finder, posed.turns);
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

}  // namespace amontons
