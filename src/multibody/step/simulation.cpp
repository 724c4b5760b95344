// A simulation: the state of a model, and the step that changes it. What the step is made of lies in the
// rooms beside and below; here is the order of its calls, and what goes from one to the next.
#include "amontons/multibody/step/simulation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/base/patience.hpp"
#include "amontons/multibody/joints/actuators.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/solvers/solvers.hpp"
#include "multibody/bodies/fluid.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "multibody/joints/joint_context.hpp"
#include "multibody/joints/stiffening.hpp"
#include "multibody/step/accounting.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/closed_contacts.hpp"
#include "multibody/step/energy_guard.hpp"
#include "multibody/step/ground.hpp"
#include "multibody/step/impact.hpp"
#include "multibody/step/positions.hpp"
#include "multibody/step/second_order.hpp"
#include "multibody/step/solve_step.hpp"
#include "multibody/step/step_problem.hpp"

namespace amontons {

namespace {

// Options are checked once, where a simulation is made; a step trusts them.
void check(const SimulationOptions& o) {
  AMONTONS_REQUIRE(o.dt > 0 && std::isfinite(o.dt), "dt must be positive and finite (s)");
  AMONTONS_REQUIRE(o.tolerance >= 0 && std::isfinite(o.tolerance),
                   "tolerance must be finite and not negative");
  AMONTONS_REQUIRE(o.budget > 0, "budget must be positive (s)");
  AMONTONS_REQUIRE(o.margin >= 0 && std::isfinite(o.margin), "margin must be finite and not negative (m)");
  AMONTONS_REQUIRE(o.recovery_speed >= 0 && !std::isnan(o.recovery_speed),
                   "recovery_speed must not be negative (m/s)");
  AMONTONS_REQUIRE(o.restitution_speed >= 0 && !std::isnan(o.restitution_speed),
                   "restitution_speed must not be negative (m/s)");
  AMONTONS_REQUIRE(o.max_substeps >= 1 && (o.max_substeps & (o.max_substeps - 1)) == 0,
                   "max_substeps must be a power of two: 1, 2, 4, ...");
  const auto& names = method_names();
  AMONTONS_REQUIRE(std::find(names.begin(), names.end(), o.method) != names.end(),
                   "unknown method \"" + o.method + "\"");
}

}  // namespace

// What a step passes from one of its calls to the next, kept between steps for its memory only: all that the
// future depends on is in State. Poses (frames) stay as they are at the start of the step; velocities at its
// start, free (with all loads, without impulses) and after it are arrays apart from them.
struct Simulation::Scratch {
  State before;
  BodyFrames frames;
  JointContexts joints;
  JointError joint_error;
  double line_error = 0;  // m
  BodyMobilities mobility;
  BodyVelocities start, free, after;
  EnergyScratch mean;
  BodyMobilities stiffened;
  std::vector<BodyImpulse> loads;
  std::vector<GyroscopicSpin> spins;
  std::vector<JointWrench> impacts;  // of the locked directions of each joint
  std::vector<Mat3> stiffness;
  ContactFinder finder;
  SmoothScratch smooth;
  StepProblem vi;
  std::vector<double> least;  // m/s
  double rest = 0;            // s: what followed the last solve of a step, the most of the last ones
  double correction = 0;      // s: what the last correction of positions took, with the look after it
  unsigned postponed = 0;     // corrections since then, for want of time
  // The problem before the last one, where nobody else holds it.
  std::shared_ptr<Problem> spare;
  // One for each kind of problem, as they remember the mechanism: that of steps has all bilateral rows.
  Elimination elimination, position_elimination, impact_elimination;
};

Simulation::Simulation(std::shared_ptr<const Model> model, SimulationOptions options)
    : model_(std::move(model)), options_(std::move(options)), scratch_(std::make_unique<Scratch>()) {
  AMONTONS_REQUIRE(model_ != nullptr, "a simulation needs a model");
  check(options_);
  state_ = initial_state(*model_);
}
// Scratch is memory only, but for the state from which the last step began.
Simulation::Simulation(const Simulation& other)
    : model_(other.model_), options_(other.options_), scratch_(std::make_unique<Scratch>()) {
  *this = other;
}
Simulation& Simulation::operator=(const Simulation& other) {
  AMONTONS_REQUIRE(model_ == other.model_, "a simulation takes over only one of the same model");
  options_ = other.options_;
  state_ = other.state_;
  contacts_ = other.contacts_;
  reactions_ = other.reactions_;
  problem_ = other.problem_;
  x_ = other.x_;
  scratch_->before = other.scratch_->before;
  return *this;
}
// Here, where Scratch is complete.
Simulation::~Simulation() = default;

const State& Simulation::last_state() const { return scratch_->before; }

// Copied, not moved: the memory of the arrays stays, of which users hold views.
void Simulation::reset() {
  const State initial = initial_state(*model_);
  state_ = initial;
  scratch_->before = {};
  contacts_.clear();
  reactions_.clear();
  problem_.reset();
  x_.clear();
}

// Automatic options follow from the model, not from the state: they stay the same for a whole run.
double Simulation::margin() const { return options_.margin > 0 ? options_.margin : model_->length() / 50; }
double Simulation::recovery_speed() const {
  if (options_.recovery_speed > 0) return options_.recovery_speed;
  return (options_.recovery == Recovery::projection ? 10 : 1) * model_->length();
}
double Simulation::restitution_speed() const {
  return options_.restitution_speed > 0 ? options_.restitution_speed
                                        : 4 * options_.dt * norm(model_->description().gravity);
}

// Of a step that made energy from nothing: halves of halves, then it is reported.
constexpr unsigned most_repairs = 4;
// Of the limit of work: what another attempt needs.
constexpr double least_share = 0.2;
// Of the time that is kept free for what follows a solve, in the next step: energy is taken back in few.
constexpr double remembered = 0.8;
// How many steps with errors of position wait for one that has no time for them either.
constexpr unsigned patient_steps = 4;
// Of the time that is left, for the solve of the step after those of its impacts.
constexpr double share_of_step_proper = 0.5;
// Times the tolerance: a step that misses it by no more would have come there with a little more work.
constexpr double nearly_solved = 10;

// Marks a step as begun, for as long as it lives.
class Begun {
 public:
  explicit Begun(std::atomic<bool>& flag) : flag_(flag) {
    AMONTONS_REQUIRE(!flag.exchange(true, std::memory_order_acquire),
                     "this simulation is in the middle of a step on another thread; give each thread a copy");
  }
  ~Begun() { flag_.store(false, std::memory_order_release); }

 private:
  std::atomic<bool>& flag_;
};

// The parts of an attempt, up to one whose energy asks for another attempt; that, or what else there is to
// try.
std::optional<Simulation::Attempt> Simulation::try_step(const Attempt& attempt, StepClock& clock,
                                                        Report& report) {
  report = {};
  report.substeps = attempt.parts;
  std::optional<Attempt> next;
  for (unsigned part = 0; part < attempt.parts && report.advanced && !next; ++part)
    next = advance(options_.dt / attempt.parts, attempt, clock, report);
  if (!report.advanced) state_ = scratch_->before;
  return next ? next : next_attempt(attempt, clock, report);
}

// Where attempts at steps have missed their tolerance by far, those that follow mostly do: they have a share
// of the work until one is solved, but for the second, the fourth, the eighth and so on in a row, which find
// out whether more helps.
double Simulation::work_limit() const {
  constexpr double share = 0.2;
  const double whole = most_work(contacts_.size() + 6 * model_->joints());
  return state_.unsolved == 0 || std::has_single_bit(state_.unsolved) ? whole : share * whole;
}

// What to try after an attempt; nothing if it is good enough or the last. It is too late for another once
// little work is left, with which it would come to less, or the budget does not hold what is beside the
// solves of an attempt.
std::optional<Simulation::Attempt> Simulation::next_attempt(Attempt last, const StepClock& clock,
                                                            const Report& report) const {
  const bool solved = report.advanced && report.status == Status::converged;
  const Timings& t = report.timings;
  if ((solved && report.balanced) || Patience::work_left() < least_share * work_limit() ||
      clock.over(t.assembly + t.collision + t.integration))
    return {};
  // What velocities cannot take back, joints may forbid; and energy has other ways to be too much.
  if (last.recovers || (!report.balanced && !last.damped)) return Attempt{1, true, false};
  if (last.parts >= std::max(options_.max_substeps, report.balanced ? 1 : most_repairs)) return {};
  last.parts *= 2;
  return last;
}

// A step that does not converge is done again in twice as many parts, from the state at its start: shorter
// steps are easier to solve, as impulses are smaller and contacts closer to what the velocities foresee. One
// that made energy from nothing is done again damped, without recovery by velocities, and then in parts.
void Simulation::make_step(Report& report) {
  // The user may have written into the state since the last step.
  validate(*model_, state_);
  Scratch& s = *scratch_;
  StepClock clock(options_.budget);
  clock.keep_free(s.rest);
  const Patience allowance(infinity);  // its work is limited once the size of the step is known
  s.before = state_;
  const bool by_velocities = options_.recovery == Recovery::velocity;
  Attempt attempt{1, by_velocities, by_velocities};
  bool missed = false;  // by far, by any attempt
  for (;;) {
    std::optional<Attempt> next;
    try {
      next = try_step(attempt, clock, report);
      missed = missed || (report.status != Status::converged &&
                          !(report.residual <= nearly_solved * options_.tolerance));
    } catch (...) {
      state_ = s.before;
      throw;
    }
    if (Patience::interrupted()) {
      state_ = s.before;
      report.advanced = false;
      report.status = Status::interrupted;
      break;
    }
    if (!next) break;
    attempt = *next;
    state_ = s.before;
  }
  // Not a sum of substeps: time = n dt without the rounding of n parts.
  if (report.advanced) {
    ++state_.steps;
    // What came too late says nothing of the work.
    if (!missed)
      state_.unsolved = 0;
    else if (report.status != Status::deadline)
      ++state_.unsolved;
    state_.time = s.before.time + options_.dt;
  }
  report.time = state_.time;
  report.timings.total = clock.elapsed();
  s.rest = std::max(clock.since_solved(), remembered * s.rest);
}

// What only a reader of the report wants: energies, those of the poses at the end.
void Simulation::finish_report(Report& report) {
  StepClock clock(infinity);
  Scratch& s = *scratch_;
  place_bodies(*model_, state_, s.frames, s.mobility, s.start);
  add_energies(*model_, state_, s.frames, s.start, options_.dt / report.substeps, report);
  clock.lap(report.timings.total);
}

Report Simulation::step() {
  const Begun begun(stepping_);
  Report report;
  make_step(report);
  finish_report(report);
  return report;
}

Simulation::Run Simulation::run(std::size_t steps, double seconds) {
  const Begun begun(stepping_);
  Run run;
  double spent = 0;
  do {
    make_step(run.report);
    ++run.steps;
    run.residual = std::max(run.residual, run.report.residual);
    spent += run.report.timings.total;
  } while (run.steps < steps && spent < seconds && run.report.is_sound());
  finish_report(run.report);
  return run;
}

namespace {

// Times the residual of no impulses. What is hit makes the last ones worse than none, and a step that starts
// from none in few iterations drops all that rests: piles of spheres and walls under iteration limits of 10
// to 50 sank into each other by several times less with 2, 3 and 10, which did alike.
constexpr double worst_start = 3;

// What all solves of a step have in common.
Options solver_options(const SimulationOptions& o) {
  Options options;
  options.law = o.law;
  options.tolerance = o.tolerance;
  options.max_iterations = o.max_iterations;
  options.threads = o.threads;
  options.worst_start = worst_start;
  return options;
}

// Of bodies with points at this distance from their centres.
Speeds fastest(const BodyVelocities& velocities, double distance) {
  Speeds most;
  for (const BodyVelocity& v : velocities) {
    most.moving = std::max(most.moving, norm(v.linear));
    most.turning = std::max(most.turning, distance * norm(v.angular));
  }
  return most;
}

// A body with a velocity that is not finite would spoil all that it touches; the step is undone instead.
bool all_finite(const BodyVelocities& velocities) {
  return std::all_of(velocities.begin(), velocities.end(), [](const BodyVelocity& v) {
    return within(v.linear, largest_coordinate) && within(v.angular, largest_coordinate);
  });
}

// The old problem, if nobody else holds it: a problem that was handed out is never changed, of one that was
// not the memory serves the next step.
std::shared_ptr<Problem> exchange(std::shared_ptr<const Problem>& problem, std::shared_ptr<Problem> next) {
  std::shared_ptr<Problem> old;
  if (problem.use_count() == 1) old = std::const_pointer_cast<Problem>(problem);
  problem = std::move(next);
  return old;
}

// What held the joints, impacts at the start included.
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

// Calls 1 to 4: what a step finds, with the free velocities that follow.
void Simulation::look(double h, bool damped, StepClock& clock, Report& report) {
  Scratch& s = *scratch_;
  const Model& model = *model_;
  // 1. Frames: poses, inertias, start velocities.
  place_bodies(model, state_, s.frames, s.mobility, s.start);
  // 2. Joint coordinates, from the poses, and what follows from both.
  update_coordinates(model, s.frames, state_);
  place_joints(model, s.frames, state_, s.joints);
  s.joint_error = joint_error(model, s.joints);
  s.line_error = line_error(model, s.frames, state_);
  // 3. Free velocities, of all loads and no impulses.
  // Motors of known effort are loads; whatever else acts on bodies and does not depend on what the step finds
  // would be added here.
  s.loads.assign(model.bodies(), BodyImpulse{});
  add_motor_loads(model, s.joints, state_, h, s.loads);
  add_actuator_loads(model, s.frames, s.joints, s.start, state_, h, s.loads);
  add_fluid_loads(model, s.frames, s.mobility, s.start, h, s.loads);
  make_free_velocities(model, state_, h, s.frames, s.mobility, s.start, s.loads, damped, s.free, s.spins);
  clock.lap(report.timings.assembly);
  // 4. Contacts that the free velocities could close.
  s.finder.find({model, s.frames, s.free, h, margin(), state_.contacts}, contacts_);
  clock.lap(report.timings.collision);
  // The size of the step is known: so is the work that it may do. A limit of the user's own takes its place.
  if (options_.max_iterations == 0 && Patience::work_left() == Patience::infinite_work)
    Patience::limit_work(work_limit());
}

// Calls 1 to 5.
Simulation::Found Simulation::find(double h, bool damped, const JointOptions& joint_options, StepClock& clock,
                                   Report& report) {
  Scratch& s = *scratch_;
  const double begun = clock.elapsed();
  look(h, damped, clock, report);
  add_errors(s.joint_error, s.line_error, contacts_, report);
  // 5. Stiffening, which changes the mobility, and the correction of positions, after which all is seen anew.
  const auto stiffen = [&] {
    s.stiffened = s.mobility;
    return stiffen_rotations(*model_, state_, h, s.frames, s.joints, s.stiffness, s.stiffened);
  };
  const bool stiffened = stiffen();
  // What is moved is looked at again. Where there is no time for that and a solve, errors of position wait,
  // for some steps.
  const double first = clock.elapsed() - begun, looked = clock.elapsed();
  if (clock.over(2 * first + s.correction) && ++s.postponed % patient_steps != 0)
    return {first, stiffened, false};
  s.postponed = 0;
  if (options_.recovery != Recovery::projection || clock.over(2 * first) ||
      !correct_positions({*model_, s.frames, s.stiffened, s.joints, contacts_, s.joint_error, s.line_error,
                          joint_options, recovery_speed()},
                         clock, s.position_elimination, state_))
    return {first, stiffened, false};
  clock.lap(report.timings.assembly);
  look(h, damped, clock, report);
  s.correction = clock.elapsed() - looked;
  return {first, stiffen(), true};
}

// The balance of energy. Where it is upset: the attempt that follows; after the last one the step goes on
// without the part of the impulses that upsets it.
std::optional<Simulation::Attempt> Simulation::keep_balance(double closed, const Attempt& attempt,
                                                            double recovery, const StepSolver& solver,
                                                            Report& report) {
  Scratch& s = *scratch_;
  const EnergyInput energy{*model_,       s.frames,      s.start,   s.free,      s.after,  s.spins,
                           *s.vi.problem, s.vi.solution, s.vi.rows, options_.dt, recovery, closed};
  EnergyBalance balance = energy_balance(energy, s.mean);
  if (!balance.holds()) {
    Report unbalanced = report;
    unbalanced.balanced = false;
    if (const auto next = next_attempt(attempt, solver.clock, unbalanced)) return next;
    balance = take_back(energy, balance, solver.elimination, solver.options, s.vi.solution, s.after, s.mean);
    measure(*s.vi.problem, options_.law, s.vi.solution);
    if (s.vi.solution.residual > options_.tolerance) s.vi.solution.status = Status::stalled;
    add_residual(s.vi.solution, report);
  }
  add_balance(balance, report);
  return {};
}

// After a solve that ended early, with velocities that no look has followed: bodies stop at what is fixed
// where they would come closer by more than an error of position is allowed to be. What they are stopped by
// joins the impulses.
void Simulation::stop_bodies(const StepBodies& bodies, const Assembly& assembly, const StepClock& clock,
                             Report& report) {
  Scratch& s = *scratch_;
  const double h = assembly.h, error = assembly.most_closed;
  slow_spins(*model_, s.start, h, s.after);
  const std::size_t known = contacts_.size();
  if (!clock.over(report.timings.collision))
    s.finder.find_fixed({*model_, s.frames, s.after, h, margin()}, contacts_);
  const bool found = contacts_.size() > known;
  if (found) {
    take_in(bodies, assembly, contacts_, known, s.vi);
    s.vi.solution.x = s.vi.x0;
  }
  const std::vector<Index>& row = s.vi.problem->graph.first_row;
  s.least.clear();
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Contact& c = contacts_[i];
    const double bias = s.vi.problem->b[row[i]] - dot(c.normal, relative_motion(c, s.free).linear);
    s.least.push_back(-std::max(bias, 0.0) - error / h);
  }
  const auto impulses =
      stop_at_ground({*model_, s.mobility, contacts_, s.least, error, h, &s.start}, s.after);
  if (!found && impulses.empty()) return;
  for (std::size_t i = 0; i < impulses.size(); ++i) s.vi.solution.x[row[i]] += impulses[i];
  measure(*s.vi.problem, options_.law, s.vi.solution);
  if (!impulses.empty()) add_residual(s.vi.solution, report);
}

// Call 10: impulses go to tables and state, then the bodies move.
void Simulation::move_on(double h) {
  Scratch& s = *scratch_;
  keep_impulses(s.vi, options_.law, h, s.frames, s.after, contacts_, state_);
  std::swap(x_, s.vi.solution.x);
  s.spare = exchange(problem_, std::move(s.vi.problem));
  fill_reactions(s.joints, state_, s.impacts, reactions_);
  integrate(*model_, s.frames, s.spins, s.after, h, state_);
  advance_activations(*model_, h, state_);
}

// One step of length h: the list "A time step" of ARCHITECTURE.md, with its numbers. Every call names what it
// reads and, last, what it writes.
std::optional<Simulation::Attempt> Simulation::advance(double h, const Attempt& attempt, StepClock& clock,
                                                       Report& report) {
  const bool damped = attempt.damped;
  Scratch& s = *scratch_;
  const Model& model = *model_;
  const double recovery = attempt.recovers ? recovery_speed() : 0;  // by velocities
  const JointOptions joint_options{h, recovery, model.length()};
  const StepBodies bodies{s.frames, s.mobility, s.start, s.free};

  const auto [first, stiffened, corrected] = find(h, damped, joint_options, clock, report);
  Speeds speeds = fastest(s.start, model.length());
  speeds.moving += h * norm(model.description().gravity);
  const StepSolver solver{options_.method, solver_options(options_), clock, first, s.elimination, speeds,
                          corrected};
  const StepSolver at_impact{options_.method, solver.options, clock, first, s.impact_elimination, speeds};
  // 6. Impacts, over before stiffness could act, change the start velocities; the free ones follow from both.
  clock.set_aside(share_of_step_proper);
  const bool bounced = resolve_impacts(
      {model, state_, s.frames, s.mobility, s.joints, joint_options, restitution_speed(), at_impact}, s.start,
      contacts_, s.impacts, report);
  clock.set_aside(0);
  if (stiffened) s.mobility = s.stiffened;
  if (bounced || stiffened)
    make_free_velocities(model, state_, h, s.frames, s.mobility, s.start, s.loads, damped, s.free, s.spins);
  // 7. Joint rows.
  s.vi.rows.clear();
  append_joint_rows(model, bodies, s.joints, state_, joint_options, s.vi.rows);
  if (!damped)
    reflect_joints({model, s.frames, s.joints, s.start, s.spins, contacts_, h}, state_, s.vi.rows, s.smooth);
  // 8. Assemble, and start from the impulses of the last step, which compliant contacts remember anyway.
  if (state_.impulse_step > 0)
    hold_contacts(model, state_.contacts, h / state_.impulse_step, s.frames, contacts_);
  // A step that made energy is done again without keeping contacts closed by a velocity.
  const Assembly assembly = assembly_of_step(model, contacts_, s.vi.rows.tags.size(), h, recovery,
                                             attempt.recovers || !damped, options_.tolerance);
  s.vi.problem = s.spare ? std::move(s.spare) : std::make_shared<Problem>();
  assemble(bodies, contacts_, s.vi.rows, assembly, *s.vi.problem);
  s.vi.x0.clear();
  s.vi.turns.added.clear();
  if (options_.warm_start) warm_start(model, state_, h, s.frames, contacts_, s.vi);
  if (!damped && !contacts_.empty() && !clock.over(2 * first)) {
    predict(s.start, s.free, s.vi, s.after);
    turn_contacts({model, s.frames, s.after, h, margin()}, s.free, enough_of_a_turn(model, h), s.finder,
                  s.vi.turns, *s.vi.problem);
  }
  clock.lap(report.timings.assembly);
  // 9. Solve, look where the velocities lead, solve again for what nobody could foresee.
  solve_and_look(model, bodies, assembly, margin(), solver, s.finder, contacts_, s.vi, s.after, report);
  if (const auto next = keep_balance(assembly.closing, attempt, recovery, solver, report)) return next;
  if (s.vi.solution.status != Status::converged) stop_bodies(bodies, assembly, clock, report);
  report.advanced = all_finite(s.after);
  if (!report.advanced) return {};
  // 10.
  move_on(h);
  clock.lap(report.timings.integration);
  return {};
}

}  // namespace amontons
