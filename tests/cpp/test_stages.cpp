// The stages of a step, each alone, without a Simulation, against closed forms.
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "amontons/multibody/kinematics/motion.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "amontons/problem/residual.hpp"
#include "check.hpp"
#include "joint_scene.hpp"
#include "multibody/bodies/middle.hpp"
#include "multibody/step/energy.hpp"
#include "multibody/step/impacts.hpp"
#include "multibody/step/lookahead.hpp"
#include "multibody/step/move_on.hpp"
#include "multibody/step/pose.hpp"
#include "multibody/step/positions.hpp"
#include "multibody/step/report_sums.hpp"
#include "multibody/step/safe_step.hpp"
#include "multibody/step/scratch.hpp"
#include "multibody/step/second_order.hpp"

using namespace amontons;
using joint_scene::hinge, joint_scene::joint_of;

namespace {

constexpr double g = 10, h = 0.01, radius = 0.5;

Index add_body(ModelDescription& d, double mass, Shape shape, const Vec3& position, const Vec3& velocity,
               const Material& material) {
  Body body;
  body.mass = mass;
  body.inertia = Mat3::diagonal(mass, mass, mass);
  body.pose.position = position;
  body.linear_velocity = velocity;
  Geom geom;
  geom.body = static_cast<Index>(d.bodies.size());
  geom.shape = std::move(shape);
  geom.material = material;
  d.bodies.push_back(body);
  d.geoms.push_back(geom);
  return geom.body;
}

ModelDescription ground(const Material& material = {.friction = 0.5}) {
  ModelDescription d;
  d.gravity = {0, 0, -g};
  Geom floor;
  floor.shape = Plane{};
  floor.material = material;
  d.geoms.push_back(floor);
  return d;
}

// A sphere of 2 kg over the ground.
ModelDescription sphere_at(double gap, double velocity, double restitution = 0) {
  const Material material{.friction = 0.5, .restitution = restitution};
  ModelDescription d = ground(material);
  add_body(d, 2, Sphere{radius}, {0, 0, radius + gap}, {0, 0, velocity}, material);
  return d;
}

// A box of 2 kg, a metre wide, on or over the ground.
ModelDescription box_at(double gap) {
  ModelDescription d = ground();
  add_body(d, 2, Box{{0.5, 0.5, 0.5}}, {0, 0, 0.5 + gap}, {}, {.friction = 0.5});
  return d;
}

// The values of a step, and all that its stages need.
struct Stages : StepScratch {
  std::shared_ptr<const Model> model;
  Tree tree;
  SimulationOptions options;
  Sleepers asleep;
  StepSetting step;
  StepClock clock{infinity};
  StepSums sums;
  State state;
  StepSolver solver{.simulation = options,
                    .clock = clock,
                    .budget = clock.budget,
                    .elimination = elimination,
                    .sums = sums,
                    .fastest = {g * h, 0}};

  explicit Stages(const ModelDescription& d)
      : model(std::make_shared<const Model>(d)),
        tree(model),
        step{.model = *model,
             .tree = tree,
             .options = options,
             .asleep = asleep,
             .visited = {},
             .finder = finder,
             .memory = memory,
             .h = h,
             .last = h,
             .margin = 0.02 * model->length(),
             .displacing = 10 * model->length(),
             .restitution = 4 * g * h},
        state(initial_state(*model)) {
    options.dt = h;
    options.tolerance = 1e-10;
    state.joint_forces.resize(tree.nv());
  }
  // Velocities of the state are those of the middle of a step before, unless a test makes this one the first.
  void observe() {
    begin_with_velocities(*model, {}, state);
    amontons::observe(step, clock, state, observed);
  }
  void before_solve() {
    observe();
    correct(step, clock, *this, state, sums);
    end_impacts(step, resolve_impacts(step, solver, state, observed), state, stiffened, observed);
    pose(step, clock, state, observed, posed);
  }
  void solve() { amontons::solve(step, solver, observed, posed, solved); }
  double normal_impulse(std::size_t contact = 0) const {
    return solved.solution.x[posed.problem->graph.first_row[contact]];
  }
};

bool same_bits(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  return a.size() == b.size() && !std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec3));
}

}  // namespace

// Breaks when a load is lost, when contacts are searched along other velocities than the free ones, or when
// an overlap is not measured. The sphere falls by g h^2 = 1 mm within the step, and the margin is 0: only the
// fall finds the contact.
TEST(observe_finds_what_free_velocities_close) {
  for (const double gap : {-0.002, 0.0009, 0.0011}) {
    Stages s(sphere_at(gap, 0));
    s.step.margin = 0;
    s.observe();
    CHECK_NEAR(s.observed.start[0].linear.z, 0, 0);
    CHECK_NEAR(s.observed.free[0].linear.z, -g * h, 1e-15);
    CHECK(s.observed.contacts.size() == (gap < 0.001 ? 1u : 0u));
    CHECK_NEAR(s.observed.errors.penetration, std::max(0.0, -gap), 1e-12);
  }
}

// Breaks when an overlap is not removed, when its removal becomes a velocity, or when contacts are those
// before it: those that are observed afterwards touch. Inequalities are soft by a thousandth of the error.
TEST(correct_displaces_and_keeps_velocities) {
  Stages s(box_at(-0.02));
  s.observe();
  CHECK(correct(s.step, s.clock, s, s.state, s.sums));
  CHECK(s.sums.solves == 1);
  CHECK_NEAR(s.state.positions[0].z, 0.5, 0.02 * 2e-3 + allowed_error(s.model->length()));
  CHECK_NEAR(norm(s.state.linear_velocities[0]), 0, 0);
  CHECK(s.observed.contacts.size() == 4);
  for (const Contact& c : s.observed.contacts) CHECK_NEAR(c.gap, s.state.positions[0].z - 0.5, 1e-12);
  CHECK(!correct(s.step, s.clock, s, s.state, s.sums));
}

// Breaks when a slider that is drawn into its table is corrected in vain in each step, which takes a robot
// twice the time. Its joint lets no degree of freedom open the overlap.
TEST(overlaps_that_a_joint_holds_are_not_corrected) {
  ModelDescription d = box_at(-0.02);
  Joint slide;
  slide.body_a = 0;
  slide.dofs = {{.kind = Dof::Kind::slide, .axis = {1, 0, 0}}};
  slide.frame_b = d.bodies[0].pose;
  d.joints.push_back(slide);
  Stages s(d);
  s.observe();
  CHECK(s.observed.errors.penetration > 0.01);
  CHECK(!correct(s.step, s.clock, s, s.state, s.sums) && s.sums.solves == 0);
}

// Newton's law of impact: u+ = -e u-, impulse m (1 + e) u-. Breaks when free velocities do not follow the
// start velocities, or when slow approaches bounce.
TEST(impacts_reverse_the_approach) {
  Stages s(sphere_at(0, -3, 0.5));
  s.step.last = 0;  // its kick is a half
  s.observe();
  const bool bounced = resolve_impacts(s.step, s.solver, s.state, s.observed);
  end_impacts(s.step, bounced, s.state, s.stiffened, s.observed);
  CHECK(bounced && s.sums.status == Status::converged && s.sums.solves == 1);
  CHECK_NEAR(s.observed.start[0].linear.z, 1.5, 1e-9);
  CHECK_NEAR(s.observed.free[0].linear.z, 1.5 - g * h / 2, 1e-9);
  CHECK_NEAR(s.observed.contacts.at(0).impulse.z, 2 * 1.5 * 3, 1e-8);
  Stages slow(sphere_at(0, -0.3, 0.5));
  slow.observe();
  CHECK(!resolve_impacts(slow.step, slow.solver, slow.state, slow.observed));
  CHECK_NEAR(slow.observed.start[0].linear.z, -0.3, 0);
}

// b is the free velocity plus the velocity that closes the gap. Breaks when either is lost, and when a start
// is not scaled with the length of the step: twice the step needs twice the impulse.
TEST(pose_makes_the_complete_problem) {
  constexpr double gap = 2e-4;
  Stages s(sphere_at(gap, 0));
  s.before_solve();
  const Problem& problem = *s.posed.problem;
  CHECK(problem.rows() == 3 && s.posed.x0.empty());
  CHECK_NEAR(problem.b[0], -g * h + gap / h, 1e-12);
  constexpr double arm = radius + gap / 2;  // to the middle of the gap; the inertia is 2 kg m^2
  CHECK_NEAR(problem.P[0], (1.0 / 2 + 2 * (1.0 / 2 + arm * arm / 2)) / 3, 1e-12);
  s.solve();
  const double impulse = s.normal_impulse();
  move_on(s.step, s.posed, s.solved, s.observed, s.state);
  s.step.h = s.step.last = 2 * h;
  s.before_solve();
  CHECK(s.posed.x0.size() == 3);
  CHECK_NEAR(s.posed.x0.at(0), 2 * impulse, 1e-12);
}

// The impulses of a box at rest are its weight times h. Breaks when the velocities do not follow from the
// impulses, or a solve is not counted.
TEST(solve_balances_the_weight) {
  Stages s(box_at(0));
  s.before_solve();
  s.solve();
  double sum = 0;
  for (std::size_t i = 0; i < s.observed.contacts.size(); ++i) sum += s.normal_impulse(i);
  CHECK(s.solved.solution.status == Status::converged && s.sums.solves == 1);
  CHECK_NEAR(sum, 2 * g * h, 1e-9);
  CHECK_NEAR(norm(s.solved.after[0].linear), 0, 1e-9);
}

// A box that stands and one that slides are islands of their own. Breaks when one that moves keeps the other
// in the problem, when what rests keeps a velocity, or when rows of the two are confused: the residual is
// that of the whole problem.
TEST(islands_at_rest_are_left_out) {
  ModelDescription d = box_at(0);
  add_body(d, 2, Box{{0.5, 0.5, 0.5}}, {3, 0, 0.5}, {}, {.friction = 0.5});
  Stages s(d);
  s.before_solve();
  s.solve();
  CHECK(!s.solved.islands.any_rests);
  move_on(s.step, s.posed, s.solved, s.observed, s.state);
  s.state.linear_velocities[1].x = 1;
  s.before_solve();
  s.solve();
  CHECK(s.solved.islands.any_rests && s.solved.islands.moving.of.problem.rows() == 12);
  CHECK_NEAR(norm(s.solved.after[0].linear) + norm(s.solved.after[0].angular), 0, 0);
  CHECK_NEAR(s.solved.after[1].linear.x, 1 - 0.5 * g * h, 1e-8);
  const Solution& x = s.solved.solution;
  const double measured = residual(*s.posed.problem, Law::coulomb, x.x);
  CHECK(x.status == Status::converged && measured <= s.options.tolerance);
  CHECK_NEAR(x.residual, measured, 1e-12);
}

// A ball strikes another, which reaches a wall behind it within the step. Nobody could foresee that contact:
// the free velocity of the second ball is zero. Breaks when it does not join, or its start is lost.
TEST(look_ahead_adds_what_a_solve_leads_to) {
  ModelDescription d;
  d.gravity = {};
  Geom wall;
  wall.shape = Plane{};
  d.geoms.push_back(wall);
  constexpr double gap = 0.02;  // m; the struck ball moves by 0.04 m
  add_body(d, 1, Sphere{radius}, {0, 0, radius + gap}, {}, {});
  add_body(d, 1, Sphere{radius}, {0, 0, 3 * radius + gap}, {0, 0, -8}, {});
  Stages s(d);
  s.step.margin = 1e-3;
  s.before_solve();
  s.solve();
  CHECK(s.observed.contacts.size() == 1);
  CHECK_NEAR(s.solved.after[0].linear.z, -4, 1e-8);
  look_ahead(s.step, s.solver, s.observed, s.posed, s.solved);
  CHECK(s.observed.contacts.size() == 2 && s.posed.again && s.sums.solves == 2);
  CHECK_NEAR(s.solved.after[0].linear.z, -gap / h, 1e-8);
  CHECK_NEAR(s.solved.after[1].linear.z, -gap / h, 1e-8);
}

// A sphere with approach v that stops needs the impulse m (v + g h). The work of s times that impulse is
// zero for s = 2 v / (v + g h) and positive beyond, where the sphere leaves faster than it came. Breaks when
// energy from nothing passes, or when the safe step does not scale to that root.
TEST(make_safe_takes_out_energy) {
  constexpr double v = 2, start = v, stop = v + g * h;
  Stages s(sphere_at(0, -v));
  s.before_solve();
  s.solve();
  s.solved.balance = energy_balance({s.step, s.observed, s.posed, s.solved});
  CHECK(s.solved.balance.holds());
  CHECK_NEAR(s.normal_impulse(), 2 * stop, 1e-8);
  for (double& x : s.solved.solution.x) x *= 3;
  apply_impulses(*s.posed.problem, s.solved.solution.x, s.solved.after = s.observed.free);
  s.solved.balance = energy_balance({s.step, s.observed, s.posed, s.solved});
  CHECK(!s.solved.balance.holds());
  make_safe(s.step, s.clock, s.elimination, s.observed, s.posed, s.solved);
  CHECK(s.solved.balance.holds() && s.solved.path == StepPath::impulses_scaled);
  // J = x (u- + u+) / 2 with u- = -v and u+ = -v - g h + x / m vanishes at x = m (2 v + g h).
  CHECK_NEAR(s.normal_impulse(), 2 * (start + stop), 1e-8);
}

// Without an impulse a fast sphere would leave through the ground within the step. Breaks when bodies are not
// stopped, or the residual is that of the impulses before.
TEST(make_safe_stops_bodies_at_the_ground) {
  Stages s(sphere_at(0, -20));
  s.before_solve();
  s.solved.solution.x.assign(3, 0.0);
  s.solved.solution.u = s.posed.problem->b;
  s.solved.solution.status = Status::stalled;
  s.solved.solution.residual = 1;
  s.solved.after = s.observed.free;
  make_safe(s.step, s.clock, s.elimination, s.observed, s.posed, s.solved);
  CHECK(s.solved.path == StepPath::bodies_stopped);
  const double allowed = allowed_error(s.model->length()) / h;
  CHECK_NEAR(s.solved.after[0].linear.z, -allowed, 1e-9);
  CHECK_NEAR(s.normal_impulse(), 2 * (20 + g * h - allowed), 1e-8);
  CHECK(s.solved.solution.residual < 1);
}

// Breaks when the limit of work grows otherwise than the size of a step.
TEST(most_work_grows_with_the_size) {
  CHECK(most_work(0) > 0);
  CHECK_NEAR(most_work(2'000'000) / most_work(1'000'000), 2, 1e-5);
}

// A step may have two parts. Breaks when the second part replaces what the first one found: errors are the
// largest, energies add up, a status stays the worst one, and a path the least accurate one.
TEST(add_part_keeps_the_worst_of_both) {
  Stages s(box_at(-1e-4));
  s.before_solve();
  s.solve();
  s.solved.balance = energy_balance({s.step, s.observed, s.posed, s.solved});
  Report report;
  add_part({{}, 0, 2e-3}, s.posed, s.solved, s.options.tolerance, s.sums, report);
  CHECK(report.contacts == 4 && report.status == Status::converged && report.joint_rows == 0);
  CHECK(report.residual == s.solved.solution.residual && report.solves == s.sums.solves);
  const double work = report.energy_balance;
  s.solved.path = StepPath::impulses_scaled;
  add_part({{}, 0, 1e-3}, s.posed, s.solved, 0, s.sums, report);
  CHECK(report.penetration == 2e-3 && report.path == StepPath::impulses_scaled);
  CHECK(report.energy_balance == 2 * work);
  CHECK(report.status == (report.residual > 0 ? Status::made_safe : Status::converged));
}

// Breaks when loops are not closed in the pose to which a step leads. Two bars of 1 m turn at w = 1 rad/s,
// with a third on their ends. The rows of the start leave an error of third order. What one correction leaves
// is smaller by the turn of the rows, h w.
TEST(close_loops_closes_joints_at_the_end) {
  ModelDescription d;
  for (const double x : {0.0, 1.0}) {
    const Index bar = add_body(d, 1, Sphere{0.1}, {x, 0, 0.5}, {0.5, 0, 0}, {});
    d.bodies[bar].angular_velocity = {0, 1, 0};
    d.joints.push_back(joint_of(bar, world, {hinge({0, 1, 0})}));
    d.joints.back().frame_a.position = {0, 0, -0.5};
    d.joints.back().frame_b.position = {x, 0, 0};
  }
  add_body(d, 1, Sphere{0.1}, {0.5, 0, 1}, {1, 0, 0}, {});
  for (const Index bar : {0, 1}) {
    d.joints.push_back(joint_of(2, bar, {hinge({0, 1, 0})}));
    d.joints.back().frame_a.position = {bar - 0.5, 0, 0};
    d.joints.back().frame_b.position = {0, 0, 0.5};
  }
  Stages s(d);
  s.options.dt = s.step.h;
  s.step.last = 0;
  s.before_solve();
  s.solve();
  const auto error = [&] {
    JointRows rows = s.posed.rows;
    const JointMotion motion{*s.model, s.observed.frames, s.observed.joints, s.solved.after, h};
    return close_joints(motion, s.state, [](std::size_t) { return true; }, rows);
  };
  const double before = error();
  CHECK(before > 0.1 * h * h * h);
  // A method that does not converge leaves the step as it was.
  const Solution first = s.solved.solution;
  const std::vector<double> b = s.posed.problem->b;
  s.options.method = "jacobi";
  s.options.max_iterations = 1;
  close_loops(s.step, s.solver, s.state, s.observed, s.posed, s.solved);
  CHECK(s.solved.solution.x == first.x && s.posed.problem->b == b);
  s.options.method = "auto";
  s.options.max_iterations = 0;
  close_loops(s.step, s.solver, s.state, s.observed, s.posed, s.solved);
  CHECK_NEAR(error(), 0, h * before);
}

// Breaks when bodies move by other velocities than those after the impulses, or the next start is not stored.
TEST(move_on_moves_by_the_velocities_after) {
  Stages s(sphere_at(0, 0));
  s.state.linear_velocities[0].x = 1;  // slides: friction mu m g h slows it by mu g h
  s.before_solve();
  s.solve();
  const double after = s.solved.after[0].linear.x;
  CHECK_NEAR(after, 1 - 0.5 * g * h, 1e-8);
  move_on(s.step, s.posed, s.solved, s.observed, s.state);
  CHECK_NEAR(s.state.positions[0].x, h * after, 1e-12);
  CHECK_NEAR(s.state.middle_velocities[0].linear.x, after, 1e-12);
  CHECK_NEAR(s.state.linear_velocities[0].x, after - 0.5 * g * h / 2, 1e-8);  // half a step later
  CHECK_NEAR(s.observed.contacts.at(0).impulse.z, 2 * g * h, 1e-8);
  CHECK(s.state.impulse_step == h && s.state.contacts.size() == 1);
}

// Breaks when the values of a step hide something on which the next one depends: here all but the state is
// new in every step, and a simulation keeps it.
static void check_that_values_are_memory_only(Trees trees) {
  ModelDescription d = ground({.friction = 0.5});
  d.trees = trees;
  add_body(d, 2, Box{{0.5, 0.5, 0.5}}, {0, 0, 0.52}, {1, 0, 0}, {.friction = 0.5});
  add_body(d, 1, Sphere{0.3}, {0.1, 0, 1.4}, {}, {.friction = 0.5, .restitution = 0.6});
  add_body(d, 1, Sphere{0.3}, {2.1, 0, 1.02}, {}, {.friction = 0.5});
  Joint joint;  // a ball that swings on the box
  joint.body_a = 2;
  joint.body_b = 0;
  joint.spherical = true;
  joint.frame_a.position = {-0.6, 0, 0};
  joint.frame_b.position = {1.5, 0, 0.5};
  d.joints.push_back(joint);
  Stages first(d);
  Simulation simulation(first.model, first.options);
  State state = first.state;
  for (int i = 0; i < 60; ++i) {
    Stages s(d);
    s.step.margin = simulation.margin();
    s.step.displacing = simulation.recovery_speed();
    s.step.restitution = simulation.restitution_speed();
    s.state = state;
    s.step.last = state.last_step;
    s.observe();
    for (const BodyVelocity& v : s.observed.start) {
      s.solver.fastest.moving = std::max(s.solver.fastest.moving, norm(v.linear) + g * h);
      s.solver.fastest.turning = std::max(s.solver.fastest.turning, s.model->length() * norm(v.angular));
    }
    s.before_solve();
    s.solve();
    look_ahead(s.step, s.solver, s.observed, s.posed, s.solved);
    move_on(s.step, s.posed, s.solved, s.observed, s.state);
    state = s.state;
    simulation.step();
    CHECK(same_bits(state.positions, simulation.state().positions));
    CHECK(same_bits(state.angular_velocities, simulation.state().angular_velocities));
  }
}
TEST(values_of_a_step_are_memory_only) { check_that_values_are_memory_only(Trees::none); }
TEST(values_of_a_step_with_trees_are_memory_only) { check_that_values_are_memory_only(Trees::automatic); }
