// A simulation: the state of a model, its options, and the steps that change the state. step.cpp contains the
// calls of a step.
#include "amontons/multibody/step/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "amontons/base/error.hpp"
#include "amontons/base/interrupt.hpp"
#include "amontons/multibody/kinematics/motion.hpp"
#include "amontons/multibody/model/state_bytes.hpp"
#include "amontons/solvers/solvers.hpp"
#include "multibody/bodies/middle.hpp"
#include "multibody/step/clock.hpp"
#include "multibody/step/report_sums.hpp"
#include "multibody/step/scratch.hpp"
#include "multibody/step/sleep.hpp"
#include "multibody/step/step_sums.hpp"

namespace amontons {

namespace {

// Options are checked once, when a simulation is made; a step assumes valid ones.
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
  if (!o.own_method) find_method(o.method);
}

}  // namespace

Simulation::Simulation(std::shared_ptr<const Model> model, SimulationOptions options)
    : model_(std::move(model)), options_(std::move(options)), scratch_(std::make_unique<StepScratch>()) {
  AMONTONS_REQUIRE(model_ != nullptr, "a simulation needs a model");
  check(options_);
  tree_ = std::make_shared<const Tree>(model_);
  state_ = first_state();
}
Simulation::Simulation(const Simulation& other)
    : model_(other.model_),
      tree_(other.tree_),
      options_(other.options_),
      scratch_(std::make_unique<StepScratch>()) {
  *this = other;
}
Simulation& Simulation::operator=(const Simulation& other) {
  AMONTONS_REQUIRE(model_ == other.model_, "a simulation takes over only one of the same model");
  options_ = other.options_;
  state_ = other.state_;
  last_ = other.last_;
  forget_whole();
  return *this;
}
// Defined here, where Scratch is complete.
Simulation::~Simulation() = default;

const State& Simulation::last_state() const { return last_.before; }

// Without forces along joints; the array has its full length, so that users can hold views of it.
State Simulation::first_state() const {
  State state = initial_state(*model_);
  state.joint_forces.resize(tree_->nv());
  state.held_joint_forces = state.joint_forces;
  return state;
}

// The poses include the correction of positions: they are those in which the impulses acted.
double Simulation::instant_time() const {
  AMONTONS_REQUIRE(state_.impulse_step > 0 && last_.stood.size() == model_->bodies(),
                   "there was no step yet to which forces could belong; call step() first");
  return last_.begun;
}

StepInstant Simulation::instant() const {
  const double time = instant_time();
  const std::vector<Transform>& poses = last_.stood;
  State there = state_;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    there.positions[i] = poses[i].position;
    there.orientations[i] = poses[i].rotation;
  }
  return {time, read_coordinates(*tree_, there).q};
}

// The user may have changed anything since the last step. A kick of another length wakes all.
void Simulation::begin_step() {
  // Any body may be the user's work if none sleeps. The others were valid before the last step.
  std::vector<Index>& changed = scratch_->memory.changed;
  if (last_.asleep.any()) find_changed(last_.before, state_, changed);
  validate(*model_, state_, last_.asleep.any() ? Subset{&changed} : Subset{});
  if (last_.asleep.any()) wake_changed(*tree_, last_.before, state_, changed, last_.asleep, last_.touching);
  copy_changes(state_, last_.before);
  begin_with_velocities(*model_, last_.asleep.visited().bodies, state_);
  if (state_.last_step != options_.dt || state_.impulse_step != options_.dt)
    wake_all(last_.asleep, last_.touching);
}

void Simulation::put_back() {
  state_ = last_.before;
  begin_with_velocities(*model_, {}, state_);
}

void Simulation::forget_whole() {
  whole_->has_contacts = false;
  whole_->solve.problem.reset();
}

const std::vector<Contact>& Simulation::contacts() const {
  if (!last_.asleep.any()) return last_.contacts;
  const std::lock_guard lock(whole_->reading);
  if (!whole_->has_contacts) join_contacts(last_.contacts, last_.found, last_.asleep, whole_->contacts);
  whole_->has_contacts = true;
  return whole_->contacts;
}

std::size_t Simulation::sleeping() const { return last_.asleep.bodies(); }

// A simulation without memory leaves out no island. Without a budget it makes the step to the end, as the
// step beside sleepers was.
const Simulation::Solve& Simulation::whole() const {
  if (!last_.beside_sleepers) return last_.solve;
  const std::lock_guard lock(whole_->reading);
  if (!whole_->solve.problem) {
    SimulationOptions options = options_;
    options.budget = infinity;
    Simulation again(model_, options);
    again.state_ = last_.before;
    again.step();
    whole_->solve = again.last_.solve;
  }
  return whole_->solve;
}

// Copied, not moved: users hold views of the arrays.
void Simulation::reset() {
  const State initial = first_state();
  state_ = initial;
  last_ = {};
  forget_whole();
}

// Rates of the instants would not do. Single steps of joints alternate about the mean, which goes into the
// rates of instants twice. Those of the middles are what the forces changed.
std::vector<double> Simulation::accelerations() const {
  std::vector<double> qdd(tree_->nv());
  if (last_.before.positions.empty()) return qdd;
  State before = last_.before, after = state_;
  amontons::show_middle(*model_, before);
  amontons::show_middle(*model_, after);
  const std::vector<double> first = read_coordinates(*tree_, before).qd,
                            last = read_coordinates(*tree_, after).qd;
  for (std::size_t i = 0; i < qdd.size(); ++i) qdd[i] = (last[i] - first[i]) / last_.between;
  return qdd;
}

void Simulation::show_middle() { amontons::show_middle(*model_, state_); }

void Simulation::begin_with_shown(bool steady) {
  amontons::begin_with_shown(state_);
  if (!steady) return;
  state_.last_step = options_.dt;
  keep_held_loads({}, state_);
}

// Automatic options are derived from the model, not from the state, so that they stay constant during a run.
double Simulation::margin() const {
  constexpr double share = 0.02;  // not tuned: a default, SimulationOptions
  return options_.margin > 0 ? options_.margin : share * model_->length();
}
double Simulation::recovery_speed() const {
  if (options_.recovery_speed > 0) return options_.recovery_speed;
  return (options_.recovery == Recovery::projection ? 10 : 1) * model_->length();  // not tuned: a default
}
double Simulation::restitution_speed() const {
  return options_.restitution_speed > 0 ? options_.restitution_speed
                                        : 4 * options_.dt * norm(model_->description().gravity);
}

// Marks a simulation as stepping during its lifetime.
class StepGuard {
 public:
  explicit StepGuard(std::atomic<bool>& flag) : flag_(flag) {
    AMONTONS_REQUIRE(!flag.exchange(true, std::memory_order_acquire),
                     "this simulation is in the middle of a step on another thread; give each thread a copy");
  }
  ~StepGuard() { flag_.store(false, std::memory_order_release); }

 private:
  std::atomic<bool>& flag_;
};

// Makes the step in `attempt.parts` parts, until one does not move on. The outcome is the worst of them.
Simulation::Outcome Simulation::try_step(const Attempt& attempt, StepClock& clock, Report& report) {
  report = {};
  report.substeps = attempt.parts;
  StepSums sums;
  clock.begin_attempt();
  Outcome worst = Outcome::sound;
  for (unsigned part = 0; part < attempt.parts && worst <= Outcome::missed; ++part)
    worst = std::max(worst, advance(options_.dt / attempt.parts, attempt, clock, sums, report));
  if (worst > Outcome::missed) state_ = last_.before;
  return worst;
}

// Attempts at a step. A step that created energy is repeated from the state at its start, damped. A step that
// created energy again, or missed its tolerance, is repeated in as many parts as the user allows. Shorter
// steps are easier to solve: impulses are smaller, bodies turn less, and contacts are closer to those that
// the velocities predict.
void Simulation::make_step(Report& report) {
  if (last_.changed_nothing && repeat_step(report)) return;
  last_.changed_nothing = last_.has_energies = false;
  forget_whole();
  StepClock clock(options_.budget, last_.to_reserve);
  begin_step();
  const double before = state_.last_step;
  bool advanced = true;
  try {
    const bool by_velocities = options_.recovery == Recovery::velocity;
    for (Attempt attempt{1, by_velocities, by_velocities, false, true};;) {
      attempt.is_last = attempt.damped && !attempt.recovers && 2 * attempt.parts > options_.max_substeps;
      const Outcome outcome = try_step(attempt, clock, report);
      if (outcome == Outcome::woken) {
        put_back();
        continue;
      }
      const bool balanced = outcome != Outcome::unbalanced;
      advanced = outcome <= Outcome::missed;
      if (outcome == Outcome::sound || (balanced && (Interrupt::requested() || clock.over_attempt()))) break;
      attempt.is_first = false;
      if (attempt.recovers) {
        attempt.recovers = false;  // joints may contradict the correction by velocities
      } else {
        if (attempt.damped || balanced) attempt.parts *= 2;
        if (balanced && attempt.parts > options_.max_substeps) break;
        attempt.damped = attempt.damped || !balanced;
      }
      put_back();
    }
  } catch (...) {
    state_ = last_.before;
    throw;
  }
  if (Interrupt::requested()) {
    state_ = last_.before;
    advanced = false;
    report.status = Status::interrupted;
  }
  report.advanced = advanced;
  // Not a sum of substeps: time = n dt without the rounding of n parts.
  if (advanced) {
    ++state_.steps;
    state_.time = last_.before.time + options_.dt;
    last_.between = options_.dt + 0.5 * (before - state_.last_step);
  }
  note_touching(advanced);
  report.time = state_.time;
  clock.lap(&Timings::integration);
  report.timings = clock.timings;
  last_.to_reserve = report.timings.integration;
  note_whether_changed(report);
}

// A step is a function of the state without its time. A scene at rest comes to a state that the step maps to
// itself, bit for bit: bodies have stopped, and the start of the solve is accepted. All later steps would
// find the same again, until somebody changes the state: a load, a control, a pose, a velocity. So nothing is
// computed for them, and results stay those of the step that changed nothing. Its joint error is not smaller
// than that of the step before, and no contact begins or ends.
//
// A method of the user's may answer the same problem in another way.
void Simulation::note_whether_changed(const Report& report) {
  last_.changed_nothing =
      report.is_sound() && !options_.own_method && differ_in_time_alone(state_, last_.before);
  if (last_.changed_nothing) last_.report = report;
}

bool Simulation::repeat_step(Report& report) {
  if (Interrupt::requested() || !differ_in_time_alone(state_, last_.before)) return false;
  StepClock clock(infinity);
  last_.before.time = last_.begun = state_.time;
  last_.before.steps = state_.steps++;
  state_.time += options_.dt;
  last_.touched = last_.touching;
  last_.report.joints_close = false;
  report = last_.report;
  report.time = state_.time;
  clock.lap(&Timings::integration);
  report.timings = clock.timings;
  return true;
}

// Parts that only a reader of the report needs: the energies of the poses at the end.
void Simulation::finish_report(Report& report) {
  if (last_.has_energies) return;
  StepClock clock(infinity);
  clock.timings = report.timings;
  Observed& o = scratch_->observed;
  const Subset visited = scratch_->memory.visited(last_.asleep).bodies;
  place_for_report(*model_, state_, visited, o);
  static const std::vector<unsigned char> none;
  add_energies(*model_, visited, report.advanced ? tree_->without_rows() : none, state_, o, report);
  if (last_.changed_nothing) {
    last_.report = report;
    last_.has_energies = true;
  }
  clock.lap(&Timings::integration);
  report.timings = clock.timings;
}

Report Simulation::step() {
  const StepGuard guard(stepping_);
  Report report;
  make_step(report);
  finish_report(report);
  return report;
}

Simulation::Run Simulation::run(std::size_t steps, double seconds) {
  const StepGuard guard(stepping_);
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

// Joint reactions of a step that moved on, including impacts at its start.
static void fill_reactions(const Observed& o, const State& state, std::vector<JointReaction>& reactions) {
  reactions.resize(o.joints.size());
  for (std::size_t j = 0; j < reactions.size(); ++j) {
    const JointPose& pose = o.joints[j].pose;
    const JointWrench &step = state.joint_wrenches[j], &impact = o.impacts[j];
    reactions[j] = {pose.a.position, rotate(pose.b.rotation, step.force + impact.force),
                    rotate(pose.b.rotation, step.torque + impact.torque)};
  }
}

// Swaps and exchanges, so that both arrays of each kind keep their memory. The memory of the last problem is
// taken if nothing else holds it: a problem that was handed out never changes.
void Simulation::keep_results(double joint_error, const Subset& visited) {
  auto& [observed, posed, solved, _1, _2, _3, _4, _5, _6, _7] = *scratch_;
  fill_reactions(observed, state_, last_.reactions);
  last_.begun = state_.time;
  last_.stood.resize(observed.frames.size());
  visited.each(last_.stood.size(), [&](std::size_t i) { last_.stood[i] = observed.frames[i].pose; });
  scratch_->memory.holds = last_.asleep.number;
  last_.joint_error = joint_error;
  std::swap(last_.contacts, observed.contacts);
  std::swap(last_.solve.x, solved.solution.x);
  std::shared_ptr<Problem> old;
  if (last_.solve.problem.use_count() == 1) old = std::const_pointer_cast<Problem>(last_.solve.problem);
  last_.solve.problem = std::exchange(posed.problem, std::move(old));
}

// A point may carry only an impact, which the contacts of the state do not include, so the pairs are stored
// here. They are in the order of the contacts; contact_events() sorts them.
void Simulation::note_touching(bool advanced) {
  if (!advanced) return void(last_.touched = last_.touching);
  std::swap(last_.touching, last_.touched);
  last_.touching.clear();
  for (const Contact& c : last_.contacts) {
    const GeomPair pair{c.body_a, c.body_b, c.geom_a, c.geom_b};
    if (!(c.impulse == Vec3{}) && (last_.touching.empty() || last_.touching.back() != pair))
      last_.touching.push_back(pair);
  }
}

ContactEvents Simulation::contact_events() const {
  auto now = last_.touching, before = last_.touched;
  for (const Contact& c : last_.asleep.contacts)
    if (!(c.impulse == Vec3{}))
      for (auto* pairs : {&now, &before}) pairs->push_back({c.body_a, c.body_b, c.geom_a, c.geom_b});
  for (auto* pairs : {&now, &before}) {
    std::sort(pairs->begin(), pairs->end());
    pairs->erase(std::unique(pairs->begin(), pairs->end()), pairs->end());
  }
  ContactEvents events;
  std::set_difference(now.begin(), now.end(), before.begin(), before.end(), std::back_inserter(events.began));
  std::set_difference(before.begin(), before.end(), now.begin(), now.end(), std::back_inserter(events.ended));
  return events;
}

namespace {

// The same contact with A and B exchanged.
Contact seen_from_b(Contact c) {
  std::swap(c.body_a, c.body_b);
  std::swap(c.geom_a, c.geom_b);
  std::swap(c.r_a, c.r_b);
  for (Vec3* v : {&c.normal, &c.surface_velocity, &c.held, &c.impulse, &c.angular_impulse, &c.slip, &c.spin})
    *v = -*v;
  return c;
}

}  // namespace

std::vector<Contact> Simulation::contacts_of(Reference body) const {
  const Index index = body.body_among(model_->description().bodies);
  std::vector<Contact> found;
  for (const Contact& c : contacts())
    if (c.body_a == index || c.body_b == index) found.push_back(c.body_a == index ? c : seen_from_b(c));
  return found;
}

std::vector<Contact> Simulation::contacts_between(Reference a, Reference b) const {
  std::vector<Contact> found = contacts_of(a);
  const Index other = b.body_among(model_->description().bodies);
  std::erase_if(found, [&](const Contact& c) { return c.body_b != other; });
  return found;
}

Vec3 Simulation::contact_force(Reference body) const {
  Vec3 impulse;
  for (const Contact& c : contacts_of(body)) impulse += c.impulse;
  return state_.impulse_step > 0 ? impulse / state_.impulse_step : impulse;
}

GeomHit Simulation::ray(const Vec3& origin, const Vec3& direction,
                        std::initializer_list<Reference> exclude) const {
  AMONTONS_REQUIRE(is_finite(origin), "ray: the origin is not finite");
  AMONTONS_REQUIRE(is_finite(direction) && !(direction == Vec3{}),
                   "ray: the direction is zero or not finite; give one of any other length");
  const auto& d = model_->description();
  std::vector<unsigned char> hidden(d.geoms.size(), 0);
  for (const Reference& body : exclude) {
    const Index index = body.body_among(d.bodies);
    for (std::size_t g = 0; g < hidden.size(); ++g) hidden[g] |= d.geoms[g].body == index;
  }
  const double scale = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
  return cast_ray(*model_, state_, {origin, normalised(direction / scale)}, hidden);
}

}  // namespace amontons
