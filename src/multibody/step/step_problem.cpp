#include "multibody/step/step_problem.hpp"

#include <algorithm>

#include "amontons/multibody/joints/joints.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "multibody/step/accounting.hpp"
#include "multibody/step/second_order.hpp"

namespace amontons {

// How often a step looks again at where its velocities lead, and solves again if bodies would overlap there.
// Each look costs a search for contacts and a solve; what the last one leaves is an overlap, which the next
// step takes back at the recovery speed.
constexpr int most_detections = 4;
// Of the time that the first solve of a step has: for what is seen after it.
constexpr double second_look = 0.3;

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
  constexpr double share = 1e-2;
  return share * h * norm(model.description().gravity);
}

// Whether bodies that touch something move no faster than the error of a start within the tolerance, before
// the step and with the impulses of the last one. Such a start is accepted, and the bodies stop. Their
// velocities would stay in the state, the starts of the next steps would add theirs, and the scene would
// never come to rest. Where anything moves, the balance of forces stays exact.
static bool is_at_rest(const Model& model, const StepBodies& bodies, const StepProblem& vi, double tolerance,
                       double h, BodyVelocities& v) {
  if (vi.x0.empty() || std::get<ContactSystem>(vi.problem->A).contacts.empty()) return false;
  const double slow = tolerance * h * norm(model.description().gravity);
  const auto is_slow = [&](const BodyVelocity& body) {
    return norm(body.linear) <= slow && model.length() * norm(body.angular) <= slow;
  };
  if (!std::all_of(bodies.start.begin(), bodies.start.end(), is_slow)) return false;
  v = bodies.free;
  apply_impulses(*vi.problem, vi.x0, v);
  return std::all_of(v.begin(), v.end(), is_slow);
}

void solve_and_look(const Model& model, const StepBodies& bodies, const Assembly& assembly, double margin,
                    StepSolver solver, ContactFinder& finder, std::vector<Contact>& contacts, StepProblem& vi,
                    BodyVelocities& after, Report& report) {
  const Reach reach{model, bodies.frames, after, assembly.h, margin};
  const double enough = enough_of_a_turn(model, assembly.h);
  // Whether contacts turn: as predicted, and then as the solve said.
  int turned = std::any_of(vi.turns.added.begin(), vi.turns.added.end(),
                           [&](const Vec3& turn) { return norm(turn) > enough; })
                   ? 2
                   : 0;
  solver.missed = report.status != Status::converged;
  for (int detections = 0;; ++detections) {
    const bool in_time = !solver.clock.over();
    // A hard solve takes all that it gets, and what its velocities lead to would not be looked for.
    if (!solver.again && second_look * solver.clock.left() > 6 * solver.look)
      solver.clock.set_aside(second_look);
    solver.at_rest = is_at_rest(model, bodies, vi, solver.options.tolerance, assembly.h, after);
    vi.solution = solve_step(solver, *vi.problem, vi.x0, std::move(vi.solution));
    solver.clock.set_aside(0);
    solver.again = true;
    solver.missed = solver.missed || vi.solution.status != Status::converged;
    after = bodies.free;
    apply_impulses(*vi.problem, vi.solution.x, after);
    if (solver.at_rest && is_accepted_start(vi.solution))
      std::fill(after.begin(), after.end(), BodyVelocity{});
    solver.clock.lap(report.timings.solve);
    solver.clock.solved(in_time);
    const std::size_t known = contacts.size();
    // A search takes about as long as those before it.
    if (detections < most_detections && !solver.clock.over(report.timings.collision))
      finder.find_unforeseen(reach, contacts);
    solver.clock.lap(report.timings.collision);
    if (contacts.size() == known) {
      if (turned == 0 || solver.clock.over()) break;
      if (turned == 2 ? !(turn_contacts(reach, bodies.free, enough, finder, vi.turns, *vi.problem) > enough)
                      : !drop_turns(reach, finder, vi.turns, *vi.problem))
        break;
      --turned;
      add_cost(vi.solution, report);
      vi.x0 = vi.solution.x;
      continue;
    }
    add_cost(vi.solution, report);
    take_in(bodies, assembly, contacts, known, vi);
    const bool smooth = !vi.turns.added.empty();
    vi.turns.added.clear();
    if (smooth) turn_contacts(reach, bodies.free, enough, finder, vi.turns, *vi.problem);
    solver.clock.lap(report.timings.assembly);
  }
  add_solution(*vi.problem, vi.solution, report);
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
