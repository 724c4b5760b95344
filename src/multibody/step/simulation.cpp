#include "amontons/multibody/step/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/error.hpp"
#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/joints/effort_motors.hpp"
#include "amontons/multibody/joints/joints.hpp"
#include "amontons/multibody/joints/measures.hpp"
#include "amontons/solvers/solvers.hpp"
#include "multibody/bodies/motion.hpp"
#include "multibody/joints/stiffening.hpp"
#include "multibody/step/step.hpp"

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

// Where x lies in its cone decides what the contact does: outside the polar cone's shadow it carries an
// impulse, strictly inside the cone it sticks.
ContactState state_of(double mu, double p, const double* x, const double* u, Law law) {
  double g[3], trial[3];
  add_saxce_term(Friction{mu}, law, u, g);
  for (int k = 0; k < 3; ++k) trial[k] = x[k] - g[k] / p;
  const double t = std::hypot(trial[1], trial[2]);
  if (trial[0] <= -mu * t) return ContactState::open;
  return t <= mu * trial[0] ? ContactState::stick : ContactState::slip;
}

}  // namespace

// Memory that steps reuse.
struct Simulation::Scratch {
  State before;
  std::vector<BodyFrame> bodies;
  std::vector<BodyMobility> mobility, stiffened;
  std::vector<BodyVelocity> start, free, after;
  std::vector<GyroscopicSpin> spins;
  std::vector<BodyImpulse> loads;
  Impact impact;
  ContactFinder finder;
  std::vector<ContactSite> sites;
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
  const auto start = Clock::now();
  scratch_->before = state_;
  Report report;
  for (unsigned parts = 1;; parts *= 2) {
    report = {};
    report.substeps = parts;
    for (unsigned part = 0; part < parts && report.advanced; ++part)
      advance(options_.dt / parts, seconds_since(start), report);
    if (!report.advanced) state_ = scratch_->before;
    const bool good = report.advanced && report.residual <= options_.tolerance;
    if (good || parts == options_.max_substeps || seconds_since(start) > options_.budget) break;
    state_ = scratch_->before;
  }
  if (report.advanced) {
    ++state_.steps;
    state_.time = scratch_->before.time + options_.dt;
  }
  report.time = state_.time;
  Scratch& s = *scratch_;
  place_bodies(*model_, state_, s.bodies, s.mobility, s.start);
  report.kinetic_energy = kinetic_energy(*model_, s.bodies, s.start);
  report.potential_energy = gravity_energy(*model_, s.bodies, s.start, 0.5 * options_.dt / report.substeps);
  report.spring_energy = spring_energy(*model_, s.bodies, state_);
  report.timings.total = seconds_since(start);
  return report;
}

void Simulation::advance(double h, double elapsed, Report& report) {
  Scratch& s = *scratch_;
  const Model& model = *model_;
  const auto begin = Clock::now();
  auto clock = begin;
  const auto lap = [&](double& phase) {
    phase += seconds_since(clock);
    clock = Clock::now();
  };
  Options options;
  options.law = options_.law;
  options.tolerance = options_.tolerance;
  options.max_iterations = options_.max_iterations;
  options.threads = options_.threads;

  place_bodies(model, state_, s.bodies, s.mobility, s.start);
  update_coordinates(model, s.bodies, state_);
  const auto free_velocities = [&](const std::vector<BodyMobility>& mobility) {
    s.loads.assign(model.bodies(), BodyImpulse{});
    add_motor_loads(model, s.bodies, state_, h, s.loads);
    make_free_velocities(model, state_, h, s.bodies, mobility, s.start, s.loads, s.free, s.spins);
  };
  free_velocities(s.mobility);
  lap(report.timings.assembly);

  s.finder.find(model, s.bodies, s.free, h, margin(), s.sites);
  for (const ContactSite& site : s.sites) report.penetration = std::max(report.penetration, -site.gap);
  lap(report.timings.collision);

  const auto joint_rows = [&](const std::vector<BodyMobility>& mobility) -> const JointRows& {
    s.rows.clear();
    const StepBodies bodies{s.bodies, mobility, s.start, s.free};
    append_joint_rows(model, bodies, state_, {h, recovery_speed(), model.length()}, s.rows);
    return s.rows;
  };
  const Assembly assembly{h, recovery_speed()};
  const auto deadline = [&] { return std::max(1e-6, options_.budget - elapsed - seconds_since(begin)); };
  options.deadline = options_.budget < infinity ? deadline() : infinity;
  const bool bounced = resolve_impacts(
      model, s.mobility, s.sites, [&]() -> const JointRows& { return joint_rows(s.mobility); }, assembly,
      restitution_speed(), options_.method, options, s.start, s.impact, report);
  const bool stiffened = stiffen_rotations(model, state_, h, s.bodies, s.mobility, s.stiffness, s.stiffened);
  const std::vector<BodyMobility>& mobility = stiffened ? s.stiffened : s.mobility;
  if (bounced || stiffened) free_velocities(mobility);
  joint_rows(mobility);
  s.x0.assign(3 * s.sites.size(), 0.0);
  if (options_.warm_start && state_.impulse_step > 0) {
    const double scale = h / state_.impulse_step;
    warm_start_contacts(model, state_.contacts, scale, s.bodies, s.sites, s.x0);
    for (double x : s.rows.x0) s.x0.push_back(scale * x);
    options.x0 = s.x0;
  }
  auto problem = std::make_shared<Problem>(assemble(model, mobility, s.free, s.sites, s.rows, assembly));
  lap(report.timings.assembly);

  Solution solution;
  for (int pass = 0;; ++pass) {
    if (options_.budget < infinity) options.deadline = deadline();
    solution = solve_step(*problem, options_.method, options);
    s.after = s.free;
    apply_impulses(*problem, solution.x, s.after);
    lap(report.timings.solve);
    const std::size_t known = s.sites.size();
    std::size_t missed = 0;
    if (pass < most_detections) {
      const double allowance = margin() / 10;
      missed = s.finder.find_missed(model, s.bodies, s.free, s.after, h, margin(), allowance, s.sites) +
               s.finder.find_overlaps(model, s.bodies, s.after, h, allowance, s.sites);
    }
    lap(report.timings.collision);
    if (missed == 0) break;
    add_cost(solution, report);
    s.x0.assign(solution.x.begin(), solution.x.begin() + static_cast<std::ptrdiff_t>(3 * known));
    s.x0.resize(3 * s.sites.size(), 0.0);
    s.x0.insert(s.x0.end(), solution.x.begin() + static_cast<std::ptrdiff_t>(3 * known), solution.x.end());
    s.impact.contacts.resize(s.sites.size());
    options.x0 = s.x0;
    problem = std::make_shared<Problem>(assemble(model, mobility, s.free, s.sites, s.rows, assembly));
    lap(report.timings.assembly);
  }
  add_solution(solution, report);
  report.contacts = s.sites.size();
  report.joint_rows = s.rows.jacobian.size();
  const JointError error = joint_error(model, s.bodies, state_);
  report.joint_error = std::max(report.joint_error, error.distance);
  report.joint_angle_error = std::max(report.joint_angle_error, error.angle);
  for (const BodyVelocity& v : s.after)
    if (!is_finite(v.linear) || !is_finite(v.angular)) report.advanced = false;
  if (!report.advanced) return;

  fill_contacts(*problem, solution);
  store_joint_impulses(s.rows, std::span(solution.x).subspan(3 * s.sites.size()), state_);
  fill_reactions();
  state_.impulse_step = h;
  problem_ = std::move(problem);
  x_ = std::move(solution.x);
  integrate(model, s.bodies, s.spins, s.after, h, state_);
  lap(report.timings.integration);
}

// The contact table and the cache of the warm start.
void Simulation::fill_contacts(const Problem& problem, const Solution& solution) {
  const Scratch& s = *scratch_;
  const std::vector<double>& x = solution.x;
  contacts_.clear(), state_.contacts.clear();
  for (std::size_t i = 0; i < s.sites.size(); ++i) {
    const ContactSite& site = s.sites[i];
    std::array<double, 3> t1, t2;
    contact_tangents(site.normal.array(), t1, t2);
    const Vec3 impulse = x[3 * i] * site.normal + x[3 * i + 1] * to_vec3(t1) + x[3 * i + 2] * to_vec3(t2);
    const Vec3 u = relative_velocity(site, s.after);
    const double un = dot(site.normal, u);
    const Vec3 slip = u - un * site.normal;
    const ContactState state =
        state_of(site.material.friction, problem.P[i], &x[3 * i], &solution.u[3 * i], options_.law);
    contacts_.push_back({site.body_a, site.body_b, site.geom_a, site.geom_b, site.point, site.normal,
                         site.gap, site.material.friction, impulse + s.impact.contacts[i], slip, un, state});
    if (x[3 * i] > 0)
      state_.contacts.push_back(
          {site.geom_a, site.geom_b, inverse(s.bodies[site.body_a].pose)(site.point), impulse});
  }
  std::stable_sort(state_.contacts.begin(), state_.contacts.end(), [](const auto& a, const auto& b) {
    return std::pair(a.geom_a, a.geom_b) < std::pair(b.geom_a, b.geom_b);
  });
}

void Simulation::fill_reactions() {
  const Scratch& s = *scratch_;
  reactions_.resize(model_->joints());
  for (std::size_t j = 0; j < reactions_.size(); ++j) {
    const Joint& joint = model_->description().joints[j];
    const Transform frame_b = joint.body_b < 0 ? joint.frame_b : s.bodies[joint.body_b].pose * joint.frame_b;
    const JointWrench &step = state_.joint_wrenches[j], &impact = s.impact.joints[j];
    reactions_[j] = {(s.bodies[joint.body_a].pose * joint.frame_a).position,
                     rotate(frame_b.rotation, step.force + impact.force),
                     rotate(frame_b.rotation, step.torque + impact.torque)};
  }
}

}  // namespace amontons
