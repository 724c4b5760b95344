// One step: the stages of "A time step" in ARCHITECTURE.md, in that order and with its numbers. Every call
// lists its inputs and, last, its outputs.
#include <algorithm>
#include <cmath>

#include "amontons/multibody/step/simulation.hpp"
#include "multibody/step/impacts.hpp"
#include "multibody/step/lookahead.hpp"
#include "multibody/step/move_on.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/pose.hpp"
#include "multibody/step/positions.hpp"
#include "multibody/step/report_sums.hpp"
#include "multibody/step/safe_step.hpp"
#include "multibody/step/scratch.hpp"
#include "multibody/step/sleep.hpp"

namespace amontons {

namespace {

// Speeds of bodies, with points at this distance from their centres.
Speeds fastest(const BodyVelocities& velocities, const Subset& visited, double distance) {
  Speeds most;
  visited.each(velocities.size(), [&](std::size_t i) {
    most.moving = std::max(most.moving, norm(velocities[i].linear));
    most.turning = std::max(most.turning, distance * norm(velocities[i].angular));
  });
  return most;
}

// A body with a velocity that is not finite would corrupt all bodies that it touches, so the step is undone.
bool all_finite(const BodyVelocities& velocities, const Subset& visited) {
  bool finite = true;
  visited.each(velocities.size(), [&](std::size_t i) {
    const BodyVelocity& v = velocities[i];
    finite = finite && within(v.linear, largest_coordinate) && within(v.angular, largest_coordinate);
  });
  return finite;
}

// A report counts islands asleep as every other: a caller must not see whether a step left them out.
void add_sleepers(const Sleepers& asleep, Report& report) {
  report.contacts += asleep.contacts.size();
  report.joint_rows += asleep.rows.size();
  report.penetration = std::max(report.penetration, asleep.penetration);
}

}  // namespace

// Whether a step would have another result for islands asleep: they wake, and the step is made again.
bool Simulation::wakes(bool all) {
  const std::vector<Index>& disturbed = scratch_->finder.disturbed();
  if (!last_.asleep.any() || (!all && disturbed.empty())) return false;
  if (all)
    wake_all(last_.asleep, last_.touching);
  else
    wake(*model_, disturbed, last_.asleep, last_.touching);
  return true;
}

// A step of another length than the last one, and a method of the user's say nothing of the next. The same
// holds for a second attempt, and for a step that corrects positions or has impacts: what they shift would
// have to be shifted again.
void Simulation::let_sleep(const StepSetting& step, std::size_t found) {
  const bool steady = step.h == options_.dt && step.last == step.h && last_.before.impulse_step == step.h;
  if (!steady || options_.own_method) return;
  const auto& [_, posed, solved, _1, _2, _3, _4, _5, _6, _7] = *scratch_;
  last_.found = fall_asleep(
      {step, last_.before, state_, posed, solved.islands, *last_.solve.problem, last_.solve.x, found},
      last_.contacts, last_.asleep);
}

Simulation::Outcome Simulation::advance(double h, const Attempt& attempt, StepClock& clock, StepSums& sums,
                                        Report& report) {
  auto& [observed, posed, solved, stiffened, kept, finder, _, elimination, impact_elimination,
         loop_elimination] = *scratch_;
  const Model& model = *model_;
  const StepSetting step{.model = model,
                         .tree = *tree_,
                         .options = options_,
                         .asleep = last_.asleep,
                         .visited = kept.begin(last_.asleep),
                         .finder = finder,
                         .memory = kept,
                         .h = h,
                         .last = state_.last_step,
                         .damped = attempt.damped,
                         .margin = margin(),
                         .recovery = attempt.recovers ? recovery_speed() : 0,
                         .displacing = recovery_speed(),
                         .restitution = restitution_speed()};
  Budget& budget = clock.budget;
  // 1. and 2.
  observe(step, clock, state_, observed);
  const PositionErrors errors = observed.errors;
  // The size of the step is known, and so is its work limit. A limit set by the user replaces it.
  if (options_.max_iterations == 0)
    budget.limit_work(
        most_work(observed.contacts.size() + last_.asleep.contacts.size() + 6 * model.joints()));
  if (wakes(false)) return Outcome::woken;  // a correction moves all that touches what moves
  const bool corrected = correct(step, clock, *scratch_, state_, sums);
  // 3. Impacts are over before stiffness can act. They change the start velocities and the free velocities.
  Speeds speeds = fastest(observed.start, step.visited.bodies, model.length());
  speeds.moving += step.fall();
  Budget before_impacts = budget.part_of_time(step::policy.share_of_part);
  // Each kind of problem has a memory of its own, because it keeps the pattern of the last one.
  const auto solver = [&](Budget& share, Elimination& memory) {
    return StepSolver{options_, clock, share, memory, sums, speeds};
  };
  const bool bounced = resolve_impacts(step, solver(before_impacts, impact_elimination), state_, observed);
  end_impacts(step, bounced, state_, stiffened, observed);
  // 4. and 5. A hard solve uses all of its time, so a share is reserved for the look ahead and later solves.
  pose(step, clock, state_, observed, posed);
  const std::size_t found = observed.contacts.size();
  if (wakes(!last_.asleep.have(posed.assembly.closing, posed.assembly.slack))) return Outcome::woken;
  clock.lap(&Timings::assembly);
  Budget before_look = budget.part_of_time(step::policy.share_of_part);
  solve(step, solver(before_look, elimination), observed, posed, solved);
  look_ahead(step, solver(budget, elimination), observed, posed, solved);
  close_loops(step, solver(budget, loop_elimination), state_, observed, posed, solved);
  // 6. and 7.
  solved.path = StepPath::accurate;
  solved.balance = energy_balance({step, observed, posed, solved});
  const bool accurate = solved.solution.status == Status::converged && solved.balance.holds();
  if (wakes(!accurate)) return Outcome::woken;
  if (!solved.balance.holds() && !attempt.is_last && !clock.over_attempt()) return Outcome::unbalanced;
  if (!accurate) make_safe(step, clock, elimination, observed, posed, solved);
  add_part(errors, posed, solved, options_.tolerance, sums, report);
  add_sleepers(last_.asleep, report);
  const double joint_error = std::max(errors.joint.distance, model.length() * errors.joint.angle);
  report.joints_close = joint_error < last_.joint_error;
  if (!all_finite(solved.after, step.visited.bodies)) return Outcome::not_finite;
  // 8.
  move_on(step, posed, solved, observed, state_);
  keep_results(joint_error, step.visited.bodies);
  last_.beside_sleepers = last_.asleep.any();
  last_.found = found;
  const bool sound = sums.status == Status::converged && solved.balance.holds();
  if (sound && attempt.is_first && !corrected && !bounced && !clock.short_of_time) let_sleep(step, found);
  clock.lap(&Timings::integration);
  return sound ? Outcome::sound : Outcome::missed;
}

}  // namespace amontons
