// One step: the calls of "A time step" in ARCHITECTURE.md, in that order and with its numbers. Every call
// lists its inputs and, last, its outputs.
#include <algorithm>
#include <cmath>
#include <utility>

#include "amontons/base/ablation.hpp"
#include "amontons/base/budget.hpp"
#include "amontons/multibody/joints/actuators.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "multibody/bodies/fluid.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "multibody/joints/stiffening.hpp"
#include "multibody/kinematics/joint_forces.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/closed_contacts.hpp"
#include "multibody/step/impacts.hpp"
#include "multibody/step/policy.hpp"
#include "multibody/step/positions.hpp"
#include "multibody/step/report_sums.hpp"
#include "multibody/step/safe_step.hpp"
#include "multibody/step/scratch.hpp"
#include "multibody/step/solve_step.hpp"
#include "multibody/trees/reactions.hpp"

namespace amontons {

namespace {

// Options common to all solves of a step.
Options solver_options(const SimulationOptions& o) {
  Options options;
  options.law = o.law;
  options.tolerance = o.tolerance;
  options.max_iterations = o.max_iterations;
  options.threads = o.threads;
  options.iterates = o.iterates;
  return options;
}

// Speeds of bodies, with points at this distance from their centres.
Speeds fastest(const BodyVelocities& velocities, double distance) {
  Speeds most;
  for (const BodyVelocity& v : velocities) {
    most.moving = std::max(most.moving, norm(v.linear));
    most.turning = std::max(most.turning, distance * norm(v.angular));
  }
  return most;
}

// A body with a velocity that is not finite would corrupt all bodies that it touches, so the step is undone.
bool all_finite(const BodyVelocities& velocities) {
  return std::all_of(velocities.begin(), velocities.end(), [](const BodyVelocity& v) {
    return within(v.linear, largest_coordinate) && within(v.angular, largest_coordinate);
  });
}

// Takes the memory of the old problem if nothing else holds it. A problem that was handed out never changes.
std::shared_ptr<Problem> exchange(std::shared_ptr<const Problem>& problem, std::shared_ptr<Problem> next) {
  std::shared_ptr<Problem> old;
  if (problem.use_count() == 1) old = std::const_pointer_cast<Problem>(problem);
  problem = std::move(next);
  return old;
}

// Joint reactions, including impacts at the start.
void fill_reactions(const JointContexts& joints, const State& state, const std::vector<JointWrench>& impacts,
                    std::vector<JointReaction>& reactions) {
  reactions.resize(joints.size());
  for (std::size_t j = 0; j < reactions.size(); ++j) {
    const JointPose& pose = joints[j].pose;
    const JointWrench &step = state.joint_wrenches[j], &impact = impacts[j];
    reactions[j] = {pose.a.position, rotate(pose.b.rotation, step.force + impact.force),
                    rotate(pose.b.rotation, step.torque + impact.torque)};
  }
}

}  // namespace

// Free velocities from the velocities at the start.
void Simulation::make_free(double h, bool damped) {
  StepScratch& s = *scratch_;
  make_free_velocities(*model_, state_, h, s.frames, s.mobility, s.start, s.loads, damped, s.free, s.spins,
                       forest_->number);
  if (!forest_->empty())
    make_free_tree_velocities(*model_, *forest_, state_, h, s.frames, s.start, s.loads, s.trees, s.free);
}

// 1. Bodies, joints, free velocities, and the contacts that these velocities could close.
void Simulation::observe(double h, bool damped, StepClock& clock, Report& report) {
  StepScratch& s = *scratch_;
  const Model& model = *model_;
  const Forest& forest = *forest_;
  if (!forest.empty()) place_trees(model, forest, state_, s.trees);
  place_bodies(model, state_, s.frames, s.mobility, s.start);
  update_coordinates(model, s.frames, state_, forest.has_joint);
  place_joints(model, s.frames, state_, s.joints, forest.has_joint);
  if (!forest.empty()) place_tree_joints(model, forest, state_, s.frames, s.trees, s.joints);
  s.joint_error = joint_error(model, s.joints);
  s.line_error = line_error(model, s.frames, state_);
  // Motors of known effort are loads. Any other load that does not depend on the results of the step would be
  // added here.
  s.loads.assign(model.bodies(), BodyImpulse{});
  add_motor_loads(model, s.joints, state_, h, s.loads);
  add_joint_forces(*tree_, s.frames, s.joints, state_, h, s.loads);
  add_actuator_loads(model, s.frames, s.joints, s.start, state_, h, s.loads);
  add_fluid_loads(model, s.frames, s.mobility, s.start, h, s.loads);
  if (!forest.empty()) make_tree_masses(model, forest, state_, s.frames, h, s.trees);
  make_free(h, damped);
  clock.lap(report.timings.assembly);
  s.finder.find({model, s.frames, s.free, h, margin()}, contacts_);
  clock.lap(report.timings.collision);
  // The size of the step is known, and so is its work limit. A limit set by the user replaces it.
  if (options_.max_iterations == 0 && Budget::work_left() == Budget::infinite_work)
    Budget::limit_work(most_work(contacts_.size() + 6 * model.joints()));
}

// 2. Bodies are displaced if a position error exceeds the allowed one, and observed again. Light links under
// high tension are stiffened; the step uses the resulting mobility. Returns whether bodies moved.
bool Simulation::correct(double h, bool damped, const JointOptions& options, double search, StepClock& clock,
                         Report& report) {
  StepScratch& s = *scratch_;
  const auto stiffen = [&] {
    s.stiffened = s.mobility;
    return stiffen_rotations(*model_, state_, h, s.frames, s.joints, s.stiffness, s.stiffened);
  };
  s.is_stiffened = stiffen();
  if (options_.recovery != Recovery::projection || clock.over(2 * search) ||
      !correct_positions({*model_, s.frames, s.stiffened, s.joints, contacts_, s.start, *forest_, s.trees,
                          s.joint_error, s.line_error, options, recovery_speed()},
                         clock, s.position_elimination, state_, report))
    return false;
  clock.lap(report.timings.assembly);
  observe(h, damped, clock, report);
  s.is_stiffened = stiffen();
  return true;
}

// The motion of trees depends on their mean rates over the step, and so on its impulses: those of the last step
// foresee them, to second order.
void Simulation::foresee_impulses(double h) {
  StepScratch& s = *scratch_;
  s.predicted = s.free;
  foresee_tree_velocities(*model_, *forest_, state_, h, s.frames, s.start,
                          s.vi.x0.empty() ? std::span<const double>{}
                                          : impulses_on_bodies(*s.vi.problem, s.vi.x0),
                          s.trees, s.free);
  for (std::size_t i = 0; i < s.free.size(); ++i) {
    s.predicted[i].linear = s.free[i].linear - s.predicted[i].linear;
    s.predicted[i].angular = s.free[i].angular - s.predicted[i].angular;
  }
  change_free(s.predicted, *s.vi.problem);
}

// 4. Joint rows and contacts as one problem, with the impulses of the last step as its start.
Assembly Simulation::pose_problem(double h, bool damped, double recovery, const JointOptions& options,
                                  const StepClock& clock, double search) {
  StepScratch& s = *scratch_;
  const Model& model = *model_;
  const StepBodies bodies{s.frames, s.mobility, s.start, s.free, s.trees.constrained};
  s.vi.rows.clear();
  append_joint_rows(model, bodies, s.joints, state_, options, s.vi.rows);
  if (!damped)
    reflect_joints({model, s.frames, s.joints, s.start, s.spins, contacts_, h}, state_, s.vi.rows, s.smooth);
  if (state_.impulse_step > 0)
    hold_contacts(model, state_.contacts, h / state_.impulse_step, s.frames, contacts_);
  const Assembly assembly = assembly_of_step(model, contacts_, s.vi.rows.tags.size(), h, recovery,
                                             recovery > 0 || !damped, options_.tolerance);
  s.vi.problem = s.reusable_problem ? std::move(s.reusable_problem) : std::make_shared<Problem>();
  s.vi.problem->law = options_.law;
  assemble(bodies, contacts_, s.vi.rows, assembly, *s.vi.problem);
  s.vi.x0.clear();
  s.vi.turns.added.clear();
  if (options_.warm_start) warm_start(model, state_, h, s.frames, contacts_, s.vi);
  if (!forest_->empty()) foresee_impulses(h);
  if (!damped && !contacts_.empty() && !clock.over(2 * search) && !off("turn contacts")) {
    predict(s.start, s.free, s.vi, s.after);
    turn_contacts({model, s.frames, s.after, h, margin()}, s.free, enough_of_a_turn(model, h), s.finder,
                  s.vi.turns, *s.vi.problem);
  }
  return assembly;
}

// 6. and 7. The energy balance, and the safe step if the solve or the balance failed. False, with nothing
// reported, if the balance of a second-order step failed: a damped one follows.
bool Simulation::keep_balance(const Assembly& assembly, const Attempt& attempt, double recovery,
                              StepSolver& solver, Report& report) {
  StepScratch& s = *scratch_;
  const StepBodies bodies{s.frames, s.mobility, s.start, s.free, s.trees.constrained};
  EnergyBalance balance = energy_balance({*model_, s.frames, s.start, s.free, s.after, s.spins, *s.vi.problem,
                                          s.vi.solution, s.vi.rows, options_.dt, recovery, assembly.closing},
                                         s.energy);
  const Timings& t = report.timings;
  if (!balance.holds() && !attempt.is_last && !solver.clock.over(t.assembly + t.collision + t.integration))
    return false;
  StepPath path = StepPath::accurate;
  if (s.vi.solution.status != Status::converged || !balance.holds())
    path = make_safe({*model_, bodies, s.spins, assembly, solver.clock, options_.law, options_.tolerance,
                      options_.dt, recovery, margin(), report.timings.collision, s.finder, s.elimination,
                      contacts_, s.vi, s.after, s.energy},
                     balance);
  add_balance(balance, report);
  add_result(*s.vi.problem, s.vi.solution, path, options_.tolerance, report);
  return true;
}

// 8. Stores impulses in tables and state, then moves the bodies.
void Simulation::move_on(double h) {
  StepScratch& s = *scratch_;
  keep_impulses(s.vi, options_.law, h, s.frames, s.after, contacts_, state_);
  if (!forest_->empty()) {
    read_rates(*forest_, s.trees, s.frames, s.after, s.trees.after);
    store_drive_impulses(*forest_, h, s.trees, state_);
    store_tree_reactions(*model_, *forest_, s.joints, s.frames, s.start,
                         impulses_on_bodies(*s.vi.problem, s.vi.solution.x), h, s.trees, state_);
  }
  std::swap(x_, s.vi.solution.x);
  s.reusable_problem = exchange(problem_, std::move(s.vi.problem));
  fill_reactions(s.joints, state_, s.impacts, reactions_);
  s.begun = state_.time;
  s.stood.clear();
  for (const BodyFrame& body : s.frames) s.stood.push_back(body.pose);
  integrate(*model_, s.frames, s.spins, s.after, h, state_, forest_->number);
  if (!forest_->empty())
    move_trees(*model_, *forest_, s.frames, s.after, h, s.trees.after, s.trees.after, s.trees, state_);
  advance_activations(*model_, h, state_);
}

bool Simulation::advance(double h, const Attempt& attempt, StepClock& clock, Report& report) {
  const bool damped = attempt.damped && !off("damped");
  StepScratch& s = *scratch_;
  const Model& model = *model_;
  const double recovery = attempt.recovers ? recovery_speed() : 0;
  const JointOptions joint_options{h, recovery, model.length()};
  // 1. and 2.
  const double search_start = clock.elapsed();
  observe(h, damped, clock, report);
  add_errors(s.joint_error, s.line_error, contacts_, report);
  const double error = std::max(s.joint_error.distance, model.length() * s.joint_error.angle);
  report.joints_close = error < std::exchange(s.last_error, error);
  const double search = clock.elapsed() - search_start;
  const bool corrected = correct(h, damped, joint_options, search, clock, report);
  // 3. Impacts are over before stiffness can act. They change the start velocities and the free velocities.
  Speeds speeds = fastest(s.start, model.length());
  speeds.moving += h * norm(model.description().gravity);
  StepSolver solver{
      options_.method, solver_options(options_), clock, search, s.elimination, speeds, report.solves,
      corrected};
  StepSolver at_impact{options_.method,      solver.options, clock,        search,
                       s.impact_elimination, speeds,         report.solves};
  if (options_.own_method) solver.own_method = at_impact.own_method = &options_.own_method;
  clock.set_aside(step::share_after_impacts);
  std::shared_ptr<const ConstrainedBodies> trees_at_impact;
  if (!forest_->empty() && std::any_of(contacts_.begin(), contacts_.end(),
                                       [](const Contact& c) { return c.material.restitution > 0; }))
    trees_at_impact = tree_masses(model, *forest_, 0, s.trees);
  const bool bounced = resolve_impacts({model, state_, s.frames, s.mobility, s.joints, joint_options,
                                        restitution_speed(), at_impact, trees_at_impact},
                                       s.start, contacts_, s.impacts, report);
  clock.set_aside(0);
  if (s.is_stiffened) s.mobility = s.stiffened;
  if (bounced || s.is_stiffened)
    make_free(h, damped);
  // 4. and 5.
  const Assembly assembly = pose_problem(h, damped, recovery, joint_options, clock, search);
  clock.lap(report.timings.assembly);
  solve_with_lookahead(model, {s.frames, s.mobility, s.start, s.free, s.trees.constrained}, assembly,
                       margin(), solver, s.finder,
                       contacts_, s.vi, s.after, report);
  // 6. and 7.
  if (!keep_balance(assembly, attempt, recovery, solver, report)) return false;
  report.advanced = all_finite(s.after);
  if (!report.advanced) return true;
  // 8.
  move_on(h);
  clock.lap(report.timings.integration);
  return true;
}

}  // namespace amontons
