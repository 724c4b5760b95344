// The step as a whole on small scenes with closed forms. Larger scenes are in tests/physics.
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "amontons/multibody/step/simulation.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/solvers/solvers.hpp"
#include "check.hpp"

using namespace amontons;

namespace {

constexpr double g = 10;

Body sphere_body(const Vec3& position, double mass, double radius, const Vec3& velocity = {}) {
  Body body;
  body.mass = mass;
  const double i = 0.4 * mass * radius * radius;
  body.inertia = Mat3::diagonal(i, i, i);
  body.pose.position = position;
  body.linear_velocity = velocity;
  return body;
}

Body box_body(const Vec3& position, double mass, const Vec3& half, const Vec3& velocity = {}) {
  Body body;
  body.mass = mass;
  const Vec3 s{half.x * half.x, half.y * half.y, half.z * half.z};
  body.inertia = Mat3::diagonal(mass / 3 * (s.y + s.z), mass / 3 * (s.x + s.z), mass / 3 * (s.x + s.y));
  body.pose.position = position;
  body.linear_velocity = velocity;
  return body;
}

void add_geom(ModelDescription& d, Index body, Shape shape, Material material = {}) {
  Geom geom;
  geom.body = body;
  geom.shape = std::move(shape);
  geom.material = material;
  d.geoms.push_back(geom);
}

ModelDescription floor_and_box(const Vec3& velocity, double friction) {
  ModelDescription d;
  d.gravity = {0, 0, -g};
  add_geom(d, world, Plane{}, {friction, 0, 0});
  d.bodies.push_back(box_body({0, 0, 0.5}, 3, {0.5, 0.5, 0.5}, velocity));
  add_geom(d, 0, Box{{0.5, 0.5, 0.5}}, {friction, 0, 0});
  return d;
}

Simulation simulate(const ModelDescription& d, double dt = 5e-3, double tolerance = 1e-10) {
  SimulationOptions options;
  options.dt = dt;
  options.tolerance = tolerance;
  return Simulation(std::make_shared<Model>(d), options);
}

}  // namespace

// A box on a conveyor is accelerated by mu g up to the speed of the belt, then sticks to it; on a kinematic
// platform likewise. Breaks with the sign of the surface velocity, or one that is not in the VI.
TEST(conveyor_and_platform_carry_a_box) {
  ModelDescription belt = floor_and_box({}, 0.5);
  belt.geoms[0].surface_velocity = {1, 0, 0};
  ModelDescription platform = floor_and_box({}, 0.5);
  Body moving;
  moving.motion = Motion::kinematic;
  moving.linear_velocity = {1, 0, 0};
  platform.bodies.push_back(moving);
  platform.geoms[0].body = 1;
  for (const ModelDescription& d : {belt, platform}) {
    Simulation sim = simulate(d);
    for (int k = 0; k < 20; ++k) sim.step();
    CHECK_NEAR(sim.state().linear_velocities[0].x, 0.5 * g * 0.1, 1e-7);
    for (int k = 0; k < 40; ++k) sim.step();
    CHECK_NEAR(sim.state().linear_velocities[0].x, 1, 1e-7);
    CHECK(sim.contacts()[0].state == ContactState::stick);
  }
}

// Bad states are refused by name before anything changes. Breaks when a NaN, a quaternion that is none or an
// infinite load gets into a step.
TEST(bad_states_are_named) {
  ModelDescription d = floor_and_box({}, 0.5);
  d.bodies[0].name = "crate";
  Simulation sim = simulate(d);
  sim.step();
  const State before = sim.state();
  sim.state().linear_velocities[0].y = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS(sim.step(), "crate");
  sim.state() = before;
  sim.state().orientations[0] = {2, 0, 0, 0};
  CHECK_THROWS(sim.step(), "unit quaternion");
  sim.state() = before;
  sim.state().forces[0].x = infinity;
  CHECK_THROWS(sim.step(), "external force");
}

// Each mistake in a model is named. Breaks if a check is dropped.
TEST(bad_models_are_named) {
  const auto model = [](auto&& spoil) {
    ModelDescription d = floor_and_box({}, 0.5);
    d.bodies[0].name = "crate";
    d.bodies.push_back(sphere_body({3, 0, 0}, 1, 1));
    Joint joint;
    joint.name = "pin";
    joint.body_a = 0, joint.body_b = 1;
    joint.dofs.emplace_back();
    d.joints.push_back(joint);
    spoil(d);
    return Model(d);
  };
  model([](auto&) {});
  CHECK_THROWS(model([](auto& d) { d.bodies[0].mass = -1; }), "crate");
  CHECK_THROWS(model([](auto& d) { d.bodies[0].inertia = Mat3::diagonal(1, 1, 3); }), "exceeds the sum");
  CHECK_THROWS(model([](auto& d) { d.bodies[0].inertia = Mat3::diagonal(1, 1, 0); }), "positive definite");
  CHECK_THROWS(model([](auto& d) { d.bodies[1].name = "crate"; }), "twice");
  CHECK_THROWS(model([](auto& d) { d.bodies[0].pose.position.x = infinity; }), "crate");
  CHECK_THROWS(model([](auto& d) { d.joints[0].body_b = 0; }), "pin");
  CHECK_THROWS(model([](auto& d) { d.joints[0].body_b = 7; }), "does not exist");
  CHECK_THROWS(model([](auto& d) { d.joints[0].dofs[0].lower = 1, d.joints[0].dofs[0].upper = 0; }), "limit");
  CHECK_THROWS(model([](auto& d) { d.geoms[1].shape = Plane{}; }), "do not move");
  CHECK_THROWS(model([](auto& d) { d.geoms[1].material.friction = -0.1; }), "friction");
  CHECK_THROWS(model([](auto& d) { d.geoms[1].body = 9; }), "does not exist");
}

// A ball at 8 m/s strikes a box that hovers 20 mm above the floor, four times the margin: nobody could
// foresee that the box needs the floor within this step, 40 mm of travel. Breaks if the step does not look
// again at where its velocities lead: the box would end 20 mm inside the floor.
TEST(an_impact_finds_the_contacts_behind) {
  ModelDescription d = floor_and_box({}, 0.3);
  d.gravity = {};
  d.bodies[0].pose.position.z = 0.52;
  d.bodies.push_back(sphere_body({0.1, 0, 1.02 + 0.3}, 1000, 0.3, {0, 0, -8}));
  add_geom(d, 1, Sphere{0.3}, {0.3, 0, 0});
  Simulation sim = simulate(d);
  double deepest = 0;
  for (int k = 0; k < 5; ++k) deepest = std::max(deepest, sim.step().penetration);
  CHECK(deepest < 0.1 * sim.margin() + 1e-6);
}

// A heavy ball at 8 m/s strikes a brick off its centre, and slides on over the turning face: normals of the
// start of a step miss (h w)(h v) ~ 2 mm per step, more than the recovery takes back. Breaks if the gaps do
// not follow the turning body.
TEST(gaps_follow_turning_bodies) {
  ModelDescription d;
  d.gravity = {};
  const Vec3 half{0.2, 0.1, 0.1};
  d.bodies = {box_body({0, 0, 0}, 28, half), sphere_body({0.12, -0.601, 0.03}, 7000, 0.5, {0, 8, 0})};
  add_geom(d, 0, Box{half}, {0.4, 0, 0});
  add_geom(d, 1, Sphere{0.5}, {0.4, 0, 0});
  Simulation sim = simulate(d);
  double deepest = 0, spin = 0;
  for (int k = 0; k < 40; ++k) {
    deepest = std::max(deepest, sim.step().penetration);
    spin = std::max(spin, norm(sim.state().angular_velocities[0]));
  }
  CHECK(spin > 10);
  CHECK(deepest < 0.1 * sim.margin());
}

// Breaks when the problem of a step has another law than the simulation, or its impulses are no solution of
// it.
TEST(the_problem_of_a_step_has_the_law_of_the_simulation) {
  for (Law law : {Law::coulomb, Law::associated}) {
    SimulationOptions options;
    options.law = law;
    Simulation sim(Model(floor_and_box({2, 0, 0}, 0.5)), options);
    CHECK(sim.step().status == Status::converged);
    CHECK(sim.problem()->law == law);
    CHECK(residual(*sim.problem(), sim.impulses()) <= options.tolerance);
  }
}

// A method of the caller's own. Breaks when it is not called, when its x is believed, when a wrong x skips
// the safe step, or when what it throws leaves a state in the middle of a step.
TEST(a_method_of_the_callers_own) {
  const auto run = [](StepMethod method) {
    SimulationOptions options;
    options.method = "mine";
    options.own_method = std::move(method);
    return Simulation(Model(floor_and_box({}, 0.5)), options);
  };
  int calls = 0;
  const auto good = [&](const Problem& problem, const Options& o) {
    ++calls;
    return solve(problem, "apgd", o).x;
  };
  Simulation sim = run(good);
  const Report report = sim.step();
  CHECK(calls > 0 && report.status == Status::converged && report.method == "mine");
  CHECK(report.path == StepPath::accurate);
  for (double value : {0.0, 1e300, std::nan("")}) {
    Simulation wrong =
        run([=](const Problem& p, const Options&) { return std::vector<double>(p.rows(), value); });
    const Report r = wrong.step();
    CHECK(r.status == Status::stalled && r.path != StepPath::accurate && r.advanced);
    CHECK(r.energy_balance <= 1e-9 || r.balanced);
    CHECK(std::abs(wrong.state().positions[0].z - 0.5) < 1e-3);  // the safe step stops it at the floor
  }
  Simulation shorter = run([](const Problem&, const Options&) { return std::vector<double>(2); });
  CHECK_THROWS(shorter.step(), "method mine returned 2 impulses but the problem has 12 rows");
  CHECK(shorter.state().time == 0 && shorter.state().positions[0].z == 0.5);
  SimulationOptions unknown;
  unknown.method = "mine";
  CHECK_THROWS(Simulation(Model(floor_and_box({}, 0.5)), unknown), "unknown method");
}
