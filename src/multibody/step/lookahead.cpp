#include "multibody/step/lookahead.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/ablation.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/report_sums.hpp"
#include "multibody/step/second_order.hpp"

namespace amontons {

void warm_start(const Model& model, const State& state, double h, const BodyFrames& frames,
                const std::vector<Contact>& contacts, StepProblem& vi) {
  if (!(state.impulse_step > 0)) return;
  const double scale = h / state.impulse_step;
  warm_start_contacts(model, state.contacts, scale, frames, contacts, vi.x0);
  for (double x : vi.rows.x0) vi.x0.push_back(scale * x);
}

void take_in(const StepBodies& bodies, const Assembly& assembly, std::vector<Contact>& contacts,
             std::size_t known, StepProblem& vi) {
  std::size_t before = 0, added = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    (i < known ? before : added) += static_cast<std::size_t>(contacts[i].rows);
  vi.x0 = vi.solution.x;
  vi.x0.insert(vi.x0.begin() + static_cast<std::ptrdiff_t>(before), added, 0.0);
  assemble(bodies, contacts, vi.rows, assembly, *vi.problem);
}

void predict(const BodyVelocities& start, const BodyVelocities& free, const StepProblem& vi,
             BodyVelocities& v) {
  v = vi.x0.empty() ? start : free;
  if (!vi.x0.empty()) apply_impulses(*vi.problem, vi.x0, v);
}

double enough_of_a_turn(const Model& model, double h) {
  return step::least_turn * h * norm(model.description().gravity);
}

// Whether bodies that touch something move no faster than the error of a start within the tolerance, both
// before the step and with the impulses of the last one. Then that start is accepted and the bodies are
// stopped. Otherwise their velocities would stay in the state, later starts would add their errors, and the
// scene would never rest. While anything moves, the balance of forces stays exact.
static bool is_at_rest(const Model& model, const StepBodies& bodies, const StepProblem& vi, double tolerance,
                       double h, BodyVelocities& v) {
  if (off("at rest") || vi.x0.empty() || std::get<ContactSystem>(vi.problem->A).contacts.empty())
    return false;
  // The residual is a norm over all bodies: one of n equal bodies may have the whole error.
  const double slow =
      tolerance * std::sqrt(static_cast<double>(model.bodies())) * h * norm(model.description().gravity);
  const auto is_slow = [&](const BodyVelocity& body) {
    return norm(body.linear) <= slow && model.length() * norm(body.angular) <= slow;
  };
  if (!std::all_of(bodies.start.begin(), bodies.start.end(), is_slow)) return false;
  v = bodies.free;
  apply_impulses(*vi.problem, vi.x0, v);
  return std::all_of(v.begin(), v.end(), is_slow);
}

// Driven bodies keep their velocities.
static void stop(const Model& model, BodyVelocities& v) {
  for (std::size_t i = 0; i < v.size(); ++i)
    if (model.is_dynamic(static_cast<Index>(i))) v[i] = {};
}

void solve_with_lookahead(const Model& model, const StepBodies& bodies, const Assembly& assembly,
                          double margin, StepSolver solver, ContactFinder& finder,
                          std::vector<Contact>& contacts, StepProblem& vi, BodyVelocities& after,
                          Report& report) {
  const Reach reach{model, bodies.frames, after, assembly.h, margin};
  const double enough = enough_of_a_turn(model, assembly.h);
  const auto solve = [&] {
    const bool in_time = !solver.clock.over();
    solver.at_rest = is_at_rest(model, bodies, vi, solver.options.tolerance, assembly.h, after);
    vi.solution = solve_step(solver, *vi.problem, vi.x0, std::move(vi.solution));
    add_cost(vi.solution, report);
    after = bodies.free;
    apply_impulses(*vi.problem, vi.solution.x, after);
    if (solver.at_rest && is_accepted_start(vi.solution)) stop(model, after);
    solver.clock.lap(report.timings.solve);
    solver.clock.solved(in_time);
  };
  for (int round = 0;; ++round) {
    // A hard solve uses all of its time, so a share is reserved for the look ahead and the second solve.
    solver.clock.set_aside(solver.again ? 0 : step::share_of_lookahead);
    solve();
    solver.clock.set_aside(0);
    if (round == (off("looks") ? 1 : step::most_looks) || solver.clock.over(report.timings.collision)) return;
    const std::size_t known = contacts.size();
    finder.find_unforeseen(reach, contacts);
    solver.clock.lap(report.timings.collision);
    const bool found = contacts.size() > known;
    // Turns follow the velocities once, and again with new contacts.
    const bool turning = !vi.turns.added.empty() && (found || round == 0);
    if (found) {
      take_in(bodies, assembly, contacts, known, vi);
      vi.turns.added.clear();
    }
    const double turned =
        turning ? turn_contacts(reach, bodies.free, enough, finder, vi.turns, *vi.problem) : 0;
    solver.clock.lap(report.timings.assembly);
    if (!found && turned == 0) return;
    if (!found) vi.x0 = vi.solution.x;
    solver.again = true;
  }
}

void keep_impulses(const StepProblem& vi, Law law, double h, const BodyFrames& frames,
                   const BodyVelocities& after, std::vector<Contact>& contacts, State& state) {
  const std::span<const double> x = vi.solution.x;
  store_impulses(*vi.problem, law, vi.solution, after, contacts);
  keep_for_warm_start(*vi.problem, x, frames, state.contacts);
  store_joint_impulses(vi.rows, x.last(vi.rows.jacobian.size()), state);
  state.impulse_step = h;
}

}  // namespace amontons
