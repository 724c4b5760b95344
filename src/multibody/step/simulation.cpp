#include "amontons/multibody/step/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/joints/effort_motors.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/solvers/solvers.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/contacts/contact_finder.hpp"
#include "multibody/contacts/contact_law.hpp"
#include "multibody/contacts/warm_start.hpp"
#include "multibody/joints/stiffening.hpp"
#include "multibody/step/accounting.hpp"
#include "multibody/step/assemble.hpp"
#include "multibody/step/impact.hpp"
#include "multibody/step/solve_step.hpp"

namespace amontons {

namespace {

// How often a step looks again at where its velocities lead, and solves again if bodies would overlap there.
constexpr int most_detections = 4;

void check(const SimulationOptions& o) {
  AMONTONS_REQUIRE(o.dt > 0 && std::isfinite(o.dt), "dt must be positive and finite (s)");
  AMONTONS_REQUIRE(o.tolerance >= 0 && std::isfinite(o.tolerance),
                   "tolerance must be finite and not negative");
  AMONTONS_REQUIRE(o.budget > 0, "budget must be positive (s)");
  AMONTONS_REQUIRE(o.threads >= 1, "threads must be at least 1");
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

// Memory that steps reuse. What a step passes from one call to the next is named in advance().
struct Simulation::Scratch {
  State before;
  std::vector<BodyFrame> frames;
  std::vector<BodyMobility> mobility, stiffened;
  std::vector<BodyVelocity> start, free, after;
  std::vector<GyroscopicSpin> spins;
  std::vector<BodyImpulse> loads;
  std::vector<JointWrench> impacts;
  ContactFinder finder;
  JointRows rows;
  std::vector<Mat3> stiffness;
  std::vector<double> x0;
};

Simulation::Simulation(std::shared_ptr<const Model> model, SimulationOptions options)
    : model_(std::move(model)), options_(std::move(options)), scratch_(std::make_unique<Scratch>()) {
  AMONTONS_REQUIRE(model_ != nullptr, "a simulation needs a model");
  check(options_);
  state_ = initial_state(*model_);
}
Simulation::~Simulation() = default;

double Simulation::margin() const { return options_.margin > 0 ? options_.margin : model_->length() / 50; }
double Simulation::recovery_speed() const {
  return options_.recovery_speed > 0 ? options_.recovery_speed : model_->length();
}
double Simulation::restitution_speed() const {
  return options_.restitution_speed > 0 ? options_.restitution_speed
                                        : 4 * options_.dt * norm(model_->description().gravity);
}

Report Simulation::step() {
  validate(*model_, state_);
  StepClock clock(options_.budget);
  Scratch& s = *scratch_;
  s.before = state_;
  Report report;
  for (unsigned parts = 1;; parts *= 2) {
    report = {};
    report.substeps = parts;
    for (unsigned part = 0; part < parts && report.advanced; ++part)
      advance(options_.dt / parts, clock, report);
    if (!report.advanced) state_ = s.before;
    const bool good = report.advanced && report.residual <= options_.tolerance;
    if (good || parts == options_.max_substeps || clock.elapsed() > options_.budget) break;
    state_ = s.before;
  }
  if (report.advanced) {
    ++state_.steps;
    state_.time = s.before.time + options_.dt;
  }
  report.time = state_.time;
  place_bodies(*model_, state_, s.frames, s.mobility, s.start);
  add_energies(*model_, state_, s.frames, s.start, options_.dt / report.substeps, report);
  report.timings.total = clock.elapsed();
  return report;
}

namespace {

Options solver_options(const SimulationOptions& o) {
  Options options;
  options.law = o.law;
  options.tolerance = o.tolerance;
  options.max_iterations = o.max_iterations;
  options.threads = o.threads;
  return options;
}

bool all_finite(const std::vector<BodyVelocity>& velocities) {
  return std::all_of(velocities.begin(), velocities.end(),
                     [](const BodyVelocity& v) { return is_finite(v.linear) && is_finite(v.angular); });
}

// x with zeros for contacts that came in after the first `known` of them.
void make_room(const std::vector<Contact>& contacts, std::size_t known, const std::vector<double>& x,
               std::vector<double>& x0) {
  std::size_t before = 0, added = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    (i < known ? before : added) += static_cast<std::size_t>(contacts[i].rows);
  x0 = x;
  x0.insert(x0.begin() + static_cast<std::ptrdiff_t>(before), added, 0.0);
}

}  // namespace

// One step of length h. The numbers are those of ARCHITECTURE.md.
void Simulation::advance(double h, StepClock& clock, Report& report) {
  Scratch& s = *scratch_;
  const Model& model = *model_;
  Options options = solver_options(options_);
  const Assembly assembly{h, recovery_speed()};
  const auto free_velocities = [&](const std::vector<BodyMobility>& mobility) {
    s.loads.assign(model.bodies(), BodyImpulse{});
    add_motor_loads(model, s.frames, state_, h, s.loads);
    make_free_velocities(model, state_, h, s.frames, mobility, s.start, s.loads, s.free, s.spins);
  };
  const auto joint_rows = [&](const std::vector<BodyMobility>& mobility) -> const JointRows& {
    s.rows.clear();
    append_joint_rows(model, {s.frames, mobility, s.start, s.free}, state_,
                      {h, recovery_speed(), model.length()}, s.rows);
    return s.rows;
  };

  // 1. Frames: poses, inertias, start velocities. 2. Joint coordinates. 3. Free velocities.
  place_bodies(model, state_, s.frames, s.mobility, s.start);
  update_coordinates(model, s.frames, state_);
  free_velocities(s.mobility);
  clock.lap(report.timings.assembly);

  // 4. Contacts within reach of the free velocities.
  s.finder.find(model, {s.frames, s.free, h, margin()}, contacts_);
  add_contacts(contacts_, report);
  clock.lap(report.timings.collision);

  // 5. Impacts change the start velocities.
  s.impacts.assign(model.joints(), JointWrench{});
  const auto solve_impact = [&](const Problem& problem) {
    options.deadline = clock.left();
    return solve(problem, options_.method, options);
  };
  const bool bounced = resolve_impacts(s.frames, s.mobility,
                                       {h, restitution_speed(), options_.tolerance, solve_impact,
                                        [&]() -> const JointRows& { return joint_rows(s.mobility); }},
                                       s.start, contacts_, s.impacts, report);
  // 6. Stiffening, and the free velocities that follow from 5 and 6.
  const bool stiffened = stiffen_rotations(model, state_, h, s.frames, s.mobility, s.stiffness, s.stiffened);
  const std::vector<BodyMobility>& mobility = stiffened ? s.stiffened : s.mobility;
  if (bounced || stiffened) free_velocities(mobility);
  // 7. Joint rows. 8. Assemble, with the impulses of the last step to start from.
  joint_rows(mobility);
  const StepBodies bodies{s.frames, mobility, s.start, s.free};
  auto problem = std::make_shared<Problem>(assemble(bodies, contacts_, s.rows, assembly));
  if (options_.warm_start && state_.impulse_step > 0) {
    const double scale = h / state_.impulse_step;
    s.x0.clear();
    warm_start_contacts(model, state_.contacts, scale, s.frames, contacts_, s.x0);
    for (double x : s.rows.x0) s.x0.push_back(scale * x);
    options.x0 = s.x0;
  }
  clock.lap(report.timings.assembly);

  // 9. Solve; look where the velocities lead, and solve again for what nobody could foresee.
  Solution solution;
  for (int detections = 0;; ++detections) {
    options.deadline = clock.left();
    solution = solve_step(*problem, options_.method, options);
    s.after = s.free;
    apply_impulses(*problem, solution.x, s.after);
    clock.lap(report.timings.solve);
    const std::size_t known = contacts_.size();
    if (detections < most_detections) {
      const Reach reach{s.frames, s.after, h, margin()};
      const double allowance = margin() / 10;
      s.finder.find_missed(model, reach, s.free, allowance, contacts_);
      s.finder.find_overlaps(model, reach, allowance, contacts_);
    }
    clock.lap(report.timings.collision);
    if (contacts_.size() == known) break;
    add_cost(solution, report);
    make_room(contacts_, known, solution.x, s.x0);
    options.x0 = s.x0;
    problem = std::make_shared<Problem>(assemble(bodies, contacts_, s.rows, assembly));
    clock.lap(report.timings.assembly);
  }
  report.contacts = contacts_.size();
  add_solution(solution, report);
  add_joints(model, s.frames, state_, s.rows.jacobian.size(), report);
  report.advanced = all_finite(s.after);
  if (!report.advanced) return;

  // 10. What the step found goes to the tables and the state; the bodies move.
  store_impulses(*problem, options_.law, solution, s.after, contacts_);
  keep_for_warm_start(*problem, solution.x, s.frames, state_.contacts);
  store_joint_impulses(s.rows, std::span(solution.x).last(s.rows.jacobian.size()), state_);
  fill_reactions();
  state_.impulse_step = h;
  problem_ = std::move(problem);
  x_ = std::move(solution.x);
  integrate(model, s.frames, s.spins, s.after, h, state_);
  clock.lap(report.timings.integration);
}

// What held the joints, impacts at the start included.
void Simulation::fill_reactions() {
  const Scratch& s = *scratch_;
  reactions_.resize(model_->joints());
  for (std::size_t j = 0; j < reactions_.size(); ++j) {
    const Joint& joint = model_->description().joints[j];
    const Transform frame_b = joint.body_b < 0 ? joint.frame_b : s.frames[joint.body_b].pose * joint.frame_b;
    const JointWrench &step = state_.joint_wrenches[j], &impact = s.impacts[j];
    reactions_[j] = {(s.frames[joint.body_a].pose * joint.frame_a).position,
                     rotate(frame_b.rotation, step.force + impact.force),
                     rotate(frame_b.rotation, step.torque + impact.torque)};
  }
}

}  // namespace amontons
