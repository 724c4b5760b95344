// Islands asleep cost nothing, and steps of a scene at rest are repeated: with the same bits as if they were
// computed.
#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/model/state_bytes.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "check.hpp"

using namespace amontons;

namespace {

constexpr double half = 0.1;  // m, of each box

struct Scene {
  ModelDescription d;

  Scene() {
    d.gravity = {0, 0, -10};
    add(world, Plane{});
  }
  void add(Index body, Shape shape) {
    Geom geom;
    geom.body = body;
    geom.shape = std::move(shape);
    d.geoms.push_back(geom);
  }
  Index body(const Vec3& position, Shape shape, const Vec3& velocity = {}) {
    Body body;
    body.mass = 1;
    body.inertia = Mat3::diagonal(0.01, 0.01, 0.01);
    body.pose.position = position;
    body.linear_velocity = velocity;
    d.bodies.push_back(body);
    const auto index = static_cast<Index>(d.bodies.size() - 1);
    add(index, std::move(shape));
    return index;
  }
  void tower(double x, int boxes) {
    for (int k = 0; k < boxes; ++k) body({x, 0, (2 * k + 1) * half}, Box{{half, half, half}});
  }
  // Bricks of which each lies on two others.
  void wall(int rows) {
    for (int row = 0; row < rows; ++row)
      for (int k = 0; k < rows - row; ++k)
        body({0.42 * k + 0.21 * row, 0, (2 * row + 1) * half}, Box{{2 * half, half, half}});
  }
  // A box that a motor of known effort moves along x, from rest at x. It hangs on its slide.
  void pusher(double x) {
    Joint joint;
    joint.body_a = body({x, 0, 5 * half}, Box{{half, half, half}});
    joint.frame_b.position = {x, 0, 5 * half};
    joint.dofs.resize(1);
    joint.dofs[0].kind = Dof::Kind::slide;
    joint.dofs[0].axis = {1, 0, 0};
    joint.dofs[0].motor.kind = MotorKind::effort;
    d.joints.push_back(joint);
  }
  // A box on the ground that holds a bar in the air: a motor along the hinge keeps the angle of its control.
  // Returns the box; the bar is the next body.
  Index arm(double x) {
    const Index trunk = body({x, 0, half}, Box{{half, half, half}});
    Joint joint;
    joint.body_a = body({x + 0.2, 0, half}, Box{{0.5 * half, 0.02, 0.02}});
    joint.body_b = trunk;
    d.bodies[joint.body_a].mass = 0.2;
    joint.frame_a.position = {-half, 0, 0};
    joint.frame_b.position = {half, 0, 0};
    joint.dofs.resize(1);
    joint.dofs[0].axis = {0, 1, 0};
    joint.dofs[0].motor = {.kind = MotorKind::position, .max_effort = 5, .kp = 200, .kd = 2};
    joint.dofs[0].armature = 0.01;
    d.joints.push_back(joint);
    return trunk;
  }
  // A pendulum that swings for ever, far from the ground.
  void pendulum(double x) {
    const Index bob = body({x + 0.5, 0, 3}, Sphere{half});
    Joint joint;
    joint.body_a = bob;
    joint.dofs.resize(1);
    joint.dofs[0].axis = {0, 1, 0};
    joint.frame_a.position = {-0.5, 0, 0};
    joint.frame_b.position = {x, 0, 3};
    d.joints.push_back(joint);
  }
};

SimulationOptions options() {
  SimulationOptions o;
  o.dt = 5e-3;
  return o;
}

bool same(const Contact& a, const Contact& b) {
  return a.geom_a == b.geom_a && a.geom_b == b.geom_b && a.point == b.point && a.normal == b.normal &&
         a.gap == b.gap && a.impulse == b.impulse && a.slip == b.slip && a.state == b.state &&
         a.normal_velocity == b.normal_velocity;
}

bool same(const Report& a, const Report& b) {
  return a.time == b.time && a.status == b.status && a.residual == b.residual && a.solves == b.solves &&
         a.contacts == b.contacts && a.penetration == b.penetration && a.kinetic_energy == b.kinetic_energy &&
         a.potential_energy == b.potential_energy && a.energy_balance == b.energy_balance &&
         a.method == b.method;
}

// A simulation beside steps without memory, in which nothing sleeps.
struct Pair {
  std::shared_ptr<const Model> model;
  Simulation simulation;
  State state = simulation.state();
  int repeated = 0;  // steps so far that were not computed: those have no problem of their own

  explicit Pair(const Scene& scene, const SimulationOptions& o = options())
      : model(std::make_shared<Model>(scene.d)), simulation(model, o) {}

  // Returns in how many of the steps something slept.
  int steps(int count) {
    int slept = 0;
    for (int k = 0; k < count; ++k) {
      const auto problem = simulation.problem();
      const Report report = simulation.step();
      slept += simulation.sleeping() > 0;
      Simulation other(model, simulation.options());
      other.state() = state;
      const Report expected = other.step();
      state = other.state();
      if (simulation.problem() == problem) {
        ++repeated;
        CHECK(same(report, expected));
      }
      CHECK(differ_in_time_alone(simulation.state(), state));
      CHECK(simulation.state().time == state.time && simulation.state().steps == state.steps);
      CHECK(report.contacts == expected.contacts && report.penetration == expected.penetration);
      CHECK(report.energy_balance == expected.energy_balance);
      CHECK(report.status == expected.status);
      CHECK_NEAR(report.residual, expected.residual, 1e-12);
      const auto &all = simulation.contacts(), &others = other.contacts();
      CHECK(all.size() == others.size());
      for (std::size_t i = 0; i < std::min(all.size(), others.size()); ++i) CHECK(same(all[i], others[i]));
    }
    return slept;
  }
  // Returns how many of the steps were repeated.
  int repeats(int count) {
    const int before = repeated;
    steps(count);
    return repeated - before;
  }
  template <class F>
  void change(F&& f) {
    f(simulation.state());
    f(state);
  }
};

}  // namespace

// Breaks if towers do not sleep beside a body that moves, or change by a bit.
TEST(islands_sleep_beside_motion) {
  Scene scene;
  scene.tower(0, 3);
  scene.tower(1, 2);
  scene.pendulum(4);
  Pair both(scene);
  CHECK(both.steps(150) > 100);
  CHECK(both.simulation.sleeping() == 5);
  CHECK(both.simulation.contact_events().began.empty());
  CHECK(both.simulation.contact_events().ended.empty());
}

// Breaks if a wall that iterations solve goes on with them beside motion, as before impulses at rest carried
// all loads, or if it comes to rest somewhere else than it stands. A report without iterations and products
// of the wall has those of the ball, one product.
TEST(walls_sleep_beside_motion) {
  Scene scene;
  scene.wall(8);
  scene.body({30, 0, half}, Sphere{half}, {1, 0, 0});
  Pair both(scene);
  both.steps(30);
  CHECK(both.simulation.sleeping() == 36);
  const State before = both.simulation.state();
  for (int k = 0; k < 20; ++k) CHECK(both.simulation.step().products <= 3);
  for (std::size_t i = 0; i < 36; ++i) {
    CHECK(both.simulation.state().positions[i] == before.positions[i]);
    // Eight rows sink by no more than the velocities of 30 steps within the tolerance: 36 bodies fall freely.
    const double most = 30 * 1e-6 * std::sqrt(36.0) * 10 * 5e-3 * 5e-3;
    CHECK(norm(before.positions[i] - both.model->description().bodies[i].pose.position) <= most);
  }
}

// Breaks if a wall that iterations solve sleeps on while a ball hits it, or differs from one that never
// slept.
TEST(walls_wake_by_touch) {
  Scene scene;
  scene.wall(5);
  scene.body({-1, 0, half}, Sphere{half}, {1.5, 0, 0});
  Pair both(scene);
  both.steps(60);
  CHECK(both.simulation.sleeping() == 15);
  both.steps(120);
  CHECK(both.simulation.sleeping() < 15);
  double moved = 0;
  for (std::size_t i = 0; i < 15; ++i)
    moved =
        std::max(moved, norm(both.state.positions[i] - both.model->description().bodies[i].pose.position));
  CHECK(moved > 1e-3);
}

// Breaks if a step takes data of bodies asleep from arrays that another simulation, or an earlier motion of
// its own, has left there; or if loads on bodies asleep add up from step to step.
TEST(copies_go_on_beside_sleepers) {
  Scene scene;
  scene.tower(0, 3);
  scene.tower(1, 2);
  scene.pendulum(4);
  Pair first(scene);
  first.change([&](State& s) {
    s.forces[0] = {0, 0, -3};
    s.joint_forces[first.simulation.tree().links()[1].first_v + 2] = -2;
  });
  first.steps(150);
  CHECK(first.simulation.sleeping() == 5);
  Pair second = first;
  second.steps(5);
  second.change([](State& s) { s.forces[0] = {25, 0, 0}; });
  second.steps(30);
  CHECK(second.simulation.sleeping() < 5);
  second.simulation = first.simulation;
  second.state = first.state;
  second.steps(5);
  CHECK(second.simulation.sleeping() == 5);
  second.change([](State& s) { s.joint_forces.assign(s.joint_forces.size(), 0.0); });
  second.steps(30);
  CHECK(second.simulation.sleeping() >= 2);
}

// Breaks if a control moves nothing because its body rests, or if a tower sleeps on when that body comes.
TEST(controls_wake) {
  Scene scene;
  scene.tower(0, 3);
  scene.pusher(-0.25);
  Pair alone(scene);
  scene.pendulum(4);
  Pair beside(scene);
  for (Pair* both : {&alone, &beside}) {
    both->steps(150);
    both->change([](State& s) { s.controls[0] = 8; });
    both->steps(1);
    // An effort of 8 N on 1 kg for 5 ms; the first step has half a kick.
    CHECK(both->state.linear_velocities[3].x > 0.5 * 8 * 5e-3);
    both->steps(60);
    CHECK(both->simulation.sleeping() == 0);
    CHECK(both->state.positions[2].x > 1e-2);
  }
}

// Breaks if what slept in one model sleeps in another that goes on from its state, where it weighs something
// else.
TEST(other_models_wake) {
  Scene scene;
  scene.tower(0, 3);
  scene.pendulum(4);
  Pair both(scene);
  both.steps(150);
  CHECK(both.simulation.sleeping() == 3);
  scene.d.gravity = {8, 0, -6};
  Pair tilted(scene);
  tilted.change([&](State& s) { s = both.state; });
  tilted.steps(40);
  CHECK(tilted.simulation.sleeping() == 0);
  CHECK(tilted.state.positions[2].x > 1e-2);
}

// Breaks if a body sleeps that a slack tendon, a coupling or a bond joins to others: these act on it without
// a row, or without a joint. Only the last tower, which nothing joins, sleeps.
TEST(bodies_that_are_joined_without_joints_stay_awake) {
  Scene scene;
  for (const double x : {0.0, 4.0}) scene.arm(x);
  Coupling gear;
  gear.joint_a = 0;
  gear.joint_b = 1;
  gear.coefficients = {0, 1};
  scene.d.couplings.push_back(gear);
  for (const double x : {2.0, 6.0, 8.0}) scene.tower(x, 2);
  Tendon rope;
  rope.path.resize(2);
  rope.path[0].body = 4;
  rope.path[1].body = 5;
  rope.upper = 1;
  scene.d.tendons.push_back(rope);
  scene.d.bonds.push_back({7, 6, {0, 0, -half}, {0, 0, half}, {0, 0, 1}, 1, 1e-3});
  scene.pendulum(12);
  Pair both(scene);
  CHECK(both.steps(200) > 100);
  CHECK(both.simulation.sleeping() == 2);
}

// Two arms at rest, beside a pendulum in coordinates or a ball that rolls.
static Scene arms_beside_motion(bool trees) {
  Scene scene;
  scene.d.trees = trees ? Trees::automatic : Trees::none;
  scene.arm(0);
  scene.arm(2);
  if (trees)
    scene.pendulum(6);
  else
    scene.body({-9, 5, half}, Sphere{half}, {1, 0, 0});
  return scene;
}

// Breaks if bodies with joints do not sleep beside motion, whether they move in coordinates or by rows, or if
// impulses along their joints, drives included, have other bits then.
TEST(islands_with_joints_sleep) {
  for (const bool trees : {false, true}) {
    Pair both(arms_beside_motion(trees));
    CHECK(both.steps(400) > 100);
    CHECK(both.simulation.sleeping() == 4);
    CHECK(norm(both.state.joint_wrenches[0].force) > 1e-3);
    CHECK(std::abs(both.state.dof_impulses[0].motor + both.state.dof_impulses[0].passive) > 1e-4);
    CHECK(both.simulation.step().joint_rows >= 2);
  }
}

// Breaks if a control, a force along a coordinate, an impulse, a load or a pose does not wake what a joint
// holds in the same step, or wakes another island.
TEST(islands_with_joints_wake) {
  for (const bool trees : {false, true}) {
    Pair rests(arms_beside_motion(trees));
    rests.steps(400);
    CHECK(rests.simulation.sleeping() == 4);
    const auto changed = [&](auto&& f) {
      Pair both = rests;
      both.change(f);
      both.steps(1);
      CHECK(both.simulation.sleeping() == 2);
      both.steps(60);
      return norm(both.state.positions[1] - rests.state.positions[1]);
    };
    CHECK(changed([](State& s) { s.controls[0] = -0.3; }) > 1e-3);
    CHECK(changed([&](State& s) { s.joint_forces[rests.simulation.tree().links()[1].first_v] = 1; }) > 1e-4);
    CHECK(changed([](State& s) { s.forces[1] = {0, 0, 5}; }) > 1e-4);
    changed([](State& s) { s.dof_impulses[0] = {}; });
  }
}

// Breaks if a ball that hits what a joint holds does not wake it.
TEST(islands_with_joints_wake_by_touch) {
  for (const bool trees : {false, true}) {
    Scene scene;
    scene.d.trees = trees ? Trees::automatic : Trees::none;
    scene.arm(0);
    scene.body({-2.5, 0, half}, Sphere{half}, {1.5, 0, 0});
    Pair both(scene);
    both.steps(500);
    CHECK(both.simulation.sleeping() == 2);
    const Vec3 bar = both.state.positions[1];
    both.steps(200);
    CHECK(norm(both.state.positions[1] - bar) > 1e-3);
  }
}

// Breaks if a joint on a driven body lets what hangs on it sleep on while that body moves.
TEST(driven_bodies_wake_by_joints) {
  for (const bool trees : {false, true}) {
    Scene scene;
    scene.d.trees = trees ? Trees::automatic : Trees::none;
    Body base;
    base.motion = Motion::kinematic;
    base.pose.position = {3, 0, 1};
    scene.d.bodies.push_back(base);
    Joint joint;
    joint.body_a = scene.body({3, 0, 0.5}, Box{{half, half, half}});
    joint.body_b = 0;
    joint.frame_a.position = {0, 0, 0.5};
    joint.dofs.resize(1);
    joint.dofs[0].axis = {0, 1, 0};
    joint.dofs[0].friction = 0.1;
    scene.d.joints.push_back(joint);
    scene.tower(0, 2);
    scene.pendulum(6);
    Pair both(scene);
    both.steps(150);
    CHECK(both.simulation.sleeping() == 3);
    both.change([](State& s) { s.linear_velocities[0] = {0.5, 0, 0}; });
    both.steps(20);
    CHECK(norm(both.state.linear_velocities[1]) > 0.01);
  }
}

// Breaks if a wall stays awake because all that touches something rests, while a ball is in flight.
TEST(walls_sleep_beside_flight) {
  Scene scene;
  scene.wall(4);
  scene.body({0, 3, 9}, Sphere{half});
  Pair both(scene);
  CHECK(both.steps(100) > 80);
  CHECK(both.simulation.sleeping() == 10);
  both.steps(250);
}

// Breaks if the correction of an overlap elsewhere wakes what rests, or moves it, with joints or without.
TEST(islands_sleep_beside_corrections) {
  for (const bool trees : {false, true}) {
    Scene scene = arms_beside_motion(trees);
    scene.tower(8, 2);
    const Index box = scene.body({12, 0, half}, Box{{half, half, half}});
    Pair both(scene);
    both.steps(400);
    CHECK(both.simulation.sleeping() == 7);
    const State before = both.state;
    for (int k = 0; k < 3; ++k) {
      both.change([&](State& s) { s.positions[box].z -= 0.05 * half; });
      both.steps(1);
      CHECK(both.simulation.sleeping() == 6);
      CHECK(both.state.positions[box].z > 0.99 * half);
    }
    for (const Index i : {0, 1, 2, 3, box - 2, box - 1})
      CHECK(both.state.positions[i] == before.positions[i]);
  }
}

// Breaks if the pose of a body at rest changes by rounding while its velocity is zero: a robot would never
// sleep whose centres of mass are not its origins, and that is turned by any angle.
TEST(poses_at_rest_keep_their_bits) {
  for (const bool trees : {false, true}) {
    Scene scene;
    scene.d.trees = trees ? Trees::automatic : Trees::none;
    for (int k = 0; k < 10; ++k) {
      const auto first = static_cast<std::size_t>(scene.arm(1.7 * k));
      const Quat turned = exponential({0, 0, 0.3 + 0.7 * k});
      for (Body& body : std::span(scene.d.bodies).subspan(first, 2)) {
        body.pose.position.y += 0.3 * k;
        body.pose = {rotate(turned, body.pose.position), turned};
        body.centre_of_mass = {0.013, 0.007, -0.011};
      }
    }
    scene.pendulum(30);
    Simulation simulation(std::make_shared<Model>(scene.d), options());
    for (int k = 0; k < 600; ++k) simulation.step();
    CHECK(simulation.sleeping() == 20);
  }
}

// Breaks if an island sleeps on while a ball hits it, or wakes without a touch.
TEST(islands_wake_by_touch) {
  Scene scene;
  scene.tower(0, 3);
  scene.tower(3, 2);
  scene.body({-1, 0, half}, Sphere{half}, {1.5, 0, 0});
  Pair both(scene);
  CHECK(both.steps(60) > 20);
  CHECK(both.simulation.sleeping() == 5);
  both.steps(200);
  CHECK(norm(both.simulation.state().positions[0]) > 0.5 * half);
}

// Breaks if a load, a velocity, a pose or the impulses of another state do not wake an island in the same
// step.
TEST(islands_wake_by_changes) {
  Scene scene;
  scene.tower(0, 3);
  scene.tower(2, 2);
  scene.pendulum(4);
  Pair both(scene);
  const auto changed = [&](auto&& f) {
    both.steps(150);
    CHECK(both.simulation.sleeping() == 5);
    both.change(f);
    both.steps(1);
    CHECK(both.simulation.sleeping() < 5);
  };
  changed([](State& s) { s.forces[2] = {4, 0, 0}; });
  changed([](State& s) { s.forces[2] = {}; });
  changed([](State& s) { s.positions[1].x += 1e-3; });
  changed([](State& s) { s.contacts[0].impulse = {}; });
  both.steps(150);
  both.change([](State& s) { s.linear_velocities[1] = {0, 0.3, 0}; });
  both.steps(1);
  CHECK(both.simulation.sleeping() == 0);
  CHECK(norm(both.simulation.state().linear_velocities[1]) > 1e-3);
}

// Breaks if the problem of a step leaves out what sleeps, or if a copy forgets who sleeps.
TEST(problems_are_whole_and_copies_sleep) {
  Scene scene;
  scene.tower(0, 3);
  scene.pendulum(4);
  Pair both(scene);
  both.steps(150);
  const auto problem = both.simulation.problem();
  CHECK(problem->rows() == both.simulation.impulses().size());
  CHECK(problem->K.contacts() == both.simulation.contacts().size());
  Simulation copy = both.simulation;
  CHECK(copy.sleeping() == 3);
  const Report a = copy.step(), b = both.simulation.step();
  CHECK(a.residual == b.residual && a.solves == b.solves && a.contacts == b.contacts);
  CHECK(differ_in_time_alone(copy.state(), both.simulation.state()));
  copy.reset();
  CHECK(copy.sleeping() == 0);
}

// Breaks if a driven body that comes, or leaves, does not wake what lies on it.
TEST(driven_bodies_wake) {
  Scene scene;
  Body plate;
  plate.motion = Motion::kinematic;
  plate.pose.position = {3, 0, 0.3};
  scene.d.bodies.push_back(plate);
  scene.add(0, Box{{0.5, 0.5, 0.1}});
  scene.body({3, 0, 0.5}, Box{{half, half, half}});
  scene.tower(0, 2);
  scene.pendulum(6);
  Pair both(scene);
  CHECK(both.steps(150) > 30);
  CHECK(both.simulation.sleeping() == 3);
  both.change([](State& s) { s.linear_velocities[0] = {0, 0, 0.2}; });
  both.steps(20);
  CHECK(both.simulation.state().positions[1].z > 0.51);
  both.change([](State& s) { s.linear_velocities[0] = {-2, 0, -0.2}; });
  both.steps(300);
}

// Three boxes on each other, of which all come to rest.
Scene tower() {
  Scene scene;
  scene.tower(0, 3);
  return scene;
}

// Breaks if a tower at rest is computed step by step, or if a repeated step has other bits or another report.
TEST(steps_at_rest_are_repeated_bit_for_bit) {
  Pair both(tower());
  CHECK(both.repeats(100) > 50);
  CHECK(both.simulation.state().steps == 100);
  CHECK(both.simulation.contact_events().began.empty());
}

// Breaks if a change of loads, velocities or poses does not wake the tower in the same step.
TEST(changes_of_the_state_wake) {
  Pair both(tower());
  CHECK(both.repeats(60) > 0);
  both.change([](State& s) { s.forces[2] = {4, 0, 0}; });
  CHECK(both.repeats(1) == 0);
  both.change([](State& s) { s.forces[2] = {}; });
  both.steps(60);
  CHECK(both.repeats(1) == 1);
  both.change([](State& s) { s.linear_velocities[1] = {0, 0.3, 0}; });
  CHECK(both.repeats(1) == 0);
  CHECK(norm(both.simulation.state().linear_velocities[1]) > 1e-3);
  both.steps(100);
  CHECK(both.repeats(1) == 1);
  both.change([](State& s) { s.positions[2].z += 0.02; });
  CHECK(both.repeats(1) == 0);
  CHECK(both.simulation.state().linear_velocities[2].z < -0.01);
}

// Breaks if a copy, or a simulation that goes back to its start, repeats a step of another state.
TEST(copies_and_resets_know_what_they_repeat) {
  Pair both(tower());
  both.steps(60);
  Pair copy = both;
  CHECK(copy.repeats(3) == 3);
  both.simulation.reset();
  both.state = both.simulation.state();
  CHECK(both.repeats(1) == 0);
}

// Breaks if a run in one call counts or tells other than single steps.
TEST(runs_repeat_too) {
  Pair both(tower());
  Simulation other = both.simulation;
  both.steps(100);
  const auto run = other.run(100);
  CHECK(run.steps == 100);
  const Report last = both.simulation.step(), next = other.step();
  CHECK(same(last, next));
  CHECK(run.report.potential_energy == last.potential_energy);
  CHECK(run.report.time == other.state().time - options().dt);
}
