#include "multibody/step/lookahead.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/ablation.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/pose.hpp"

namespace amontons {

// Whether bodies that touch something move no faster than the error of a start within the tolerance, both
// before the step and with the impulses of the last one. Then that start is accepted and the bodies are
// stopped. Otherwise their velocities would stay in the state, later starts would add their errors, and the
// scene would never rest. While anything moves, the balance of forces stays exact.
static bool is_at_rest(const StepSetting& step, const Observed& o, const StepProblem& posed,
                       BodyVelocities& v) {
  if (off("at rest") || posed.x0.empty() || o.contacts.empty()) return false;
  // The residual is a norm over all bodies: one of n equal bodies may have the whole error.
  const Model& model = step.model;
  const double slow = step.options.tolerance * std::sqrt(static_cast<double>(model.bodies())) * step.h *
                      norm(model.description().gravity);
  const auto is_slow = [&](const BodyVelocity& body) {
    return norm(body.linear) <= slow && model.length() * norm(body.angular) <= slow;
  };
  if (!std::all_of(o.start.begin(), o.start.end(), is_slow)) return false;
  v = o.free;
  apply_impulses(*posed.problem, posed.x0, v);
  return std::all_of(v.begin(), v.end(), is_slow);
}

// Driven bodies keep their velocities.
static void stop(const Model& model, BodyVelocities& v) {
  for (std::size_t i = 0; i < v.size(); ++i)
    if (model.is_dynamic(static_cast<Index>(i))) v[i] = {};
}

void solve(const StepSetting& step, StepSolver& solver, const Observed& o, const StepProblem& posed,
           Solved& solved) {
  const bool in_time = !solver.clock.over();
  solver.at_rest = is_at_rest(step, o, posed, solved.after);
  solved.solution = solve_step(solver, *posed.problem, posed.x0, std::move(solved.solution));
  solved.after = o.free;
  apply_impulses(*posed.problem, solved.solution.x, solved.after);
  if (solver.at_rest && is_accepted_start(solved.solution)) stop(step.model, solved.after);
  solver.clock.lap(&Timings::solve);
  solver.clock.solved(in_time);
}

// Adds what the solved velocities lead to. Turns follow the velocities once (`first`), and again with new
// contacts. Returns whether the problem changed.
static bool add_unforeseen(const StepSetting& step, StepClock& clock, bool first, Observed& o,
                           StepProblem& posed, const Solved& solved) {
  const Reach reach{step.model, o.frames, solved.after, step.h, step.margin};
  const std::size_t known = o.contacts.size();
  o.finder.find_unforeseen(reach, o.contacts);
  clock.lap(&Timings::collision);
  const bool found = o.contacts.size() > known;
  const bool turning = !posed.turns.added.empty() && (found || first);
  if (found) {
    take_in(solved.solution.x, known, o, posed);
    posed.turns.added.clear();
  }
  const double turned =
      turning ? turn_contacts(reach, o.free, enough_of_a_turn(step), o.finder, posed.turns, *posed.problem)
              : 0;
  clock.lap(&Timings::assembly);
  if (!found && turned > 0) posed.x0 = solved.solution.x;
  return found || turned > 0;
}

void look_ahead(const StepSetting& step, StepSolver& solver, Observed& o, StepProblem& posed,
                Solved& solved) {
  const int most = off("looks") ? 1 : step::most_looks;
  for (int round = 0; round < most && !solver.clock.over(solver.clock.timings.collision); ++round) {
    if (!add_unforeseen(step, solver.clock, round == 0, o, posed, solved)) return;
    solver.again = true;
    solve(step, solver, o, posed, solved);
  }
}

}  // namespace amontons
