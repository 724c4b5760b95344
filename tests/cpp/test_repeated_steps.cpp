// Steps that change nothing but the time are not computed, with the same bits as if they were.
#include <cmath>
#include <memory>
#include <utility>

#include "amontons/multibody/model/state_bytes.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "check.hpp"

using namespace amontons;

namespace {

constexpr double half = 0.1;  // m, of each box

// Boxes on a floor, the upper ones on the lower ones.
ModelDescription tower(int boxes) {
  ModelDescription d;
  d.gravity = {0, 0, -10};
  const auto add = [&](Index body, Shape shape) {
    Geom geom;
    geom.body = body;
    geom.shape = std::move(shape);
    d.geoms.push_back(geom);
  };
  add(world, Plane{});
  for (int k = 0; k < boxes; ++k) {
    Body body;
    body.mass = 1;
    body.inertia = Mat3::diagonal(0.01, 0.01, 0.01);
    body.pose.position = {0, 0, (2 * k + 1) * half};
    d.bodies.push_back(body);
    add(static_cast<Index>(k), Box{{half, half, half}});
  }
  return d;
}

SimulationOptions options() {
  SimulationOptions o;
  o.dt = 5e-3;
  return o;
}

// A step without any memory of the one before: it is always computed.
Report computed_step(const std::shared_ptr<const Model>& model, State& state) {
  Simulation s(model, options());
  s.state() = state;
  const Report report = s.step();
  state = s.state();
  return report;
}

bool same(const Report& a, const Report& b) {
  return a.time == b.time && a.status == b.status && a.residual == b.residual && a.solves == b.solves &&
         a.contacts == b.contacts && a.penetration == b.penetration && a.kinetic_energy == b.kinetic_energy &&
         a.potential_energy == b.potential_energy && a.energy_balance == b.energy_balance &&
         a.method == b.method;
}

// Steps of a simulation beside steps that are all computed. Returns the number of those that were repeated:
// a step that is computed has a problem of its own.
int steps_alike(Simulation& s, const std::shared_ptr<const Model>& model, State& state, int count) {
  int repeated = 0;
  for (int k = 0; k < count; ++k) {
    const auto problem = s.problem();
    const Report report = s.step(), expected = computed_step(model, state);
    CHECK(same(report, expected));
    CHECK(differ_in_time_alone(s.state(), state));
    CHECK(s.state().time == state.time && s.state().steps == state.steps);
    repeated += s.problem() == problem;
  }
  return repeated;
}

struct Pair {
  std::shared_ptr<const Model> model = std::make_shared<Model>(tower(3));
  Simulation simulation{model, options()};
  State state = simulation.state();
  int steps(int count) { return steps_alike(simulation, model, state, count); }
  // Changes both states.
  template <class F>
  void change(F&& f) {
    f(simulation.state());
    f(state);
  }
};

}  // namespace

// Breaks if a tower at rest is computed step by step, or if a repeated step has other bits or another report.
TEST(steps_at_rest_are_repeated_bit_for_bit) {
  Pair both;
  CHECK(both.steps(100) > 50);
  CHECK(both.simulation.state().steps == 100);
  CHECK(both.simulation.contact_events().began.empty());
}

// Breaks if a change of loads, velocities or poses does not wake the tower in the same step.
TEST(changes_of_the_state_wake) {
  Pair both;
  CHECK(both.steps(60) > 0);
  both.change([](State& s) { s.forces[2] = {4, 0, 0}; });
  CHECK(both.steps(1) == 0);
  both.change([](State& s) { s.forces[2] = {}; });
  both.steps(60);
  CHECK(both.steps(1) == 1);
  both.change([](State& s) { s.linear_velocities[1] = {0, 0.3, 0}; });
  CHECK(both.steps(1) == 0);
  CHECK(norm(both.simulation.state().linear_velocities[1]) > 1e-3);
  both.steps(100);
  CHECK(both.steps(1) == 1);
  both.change([](State& s) { s.positions[2].z += 0.02; });
  CHECK(both.steps(1) == 0);
  CHECK(both.simulation.state().linear_velocities[2].z < -0.01);
}

// Breaks if a copy, or a simulation that goes back to its start, repeats a step of another state.
TEST(copies_and_resets_know_what_they_repeat) {
  Pair both;
  both.steps(60);
  Simulation copy = both.simulation;
  State state = both.state;
  CHECK(steps_alike(copy, both.model, state, 3) == 3);
  both.simulation.reset();
  both.state = both.simulation.state();
  CHECK(both.steps(1) == 0);
}

// Breaks if a run in one call counts or tells other than single steps.
TEST(runs_repeat_too) {
  Pair both;
  Simulation other = both.simulation;
  both.steps(100);
  const auto run = other.run(100);
  CHECK(run.steps == 100);
  const Report last = both.simulation.step(), next = other.step();
  CHECK(same(last, next));
  CHECK(run.report.potential_energy == last.potential_energy);
  CHECK(run.report.time == other.state().time - options().dt);
}
