// Free motion: what the integrator must keep without any constraint.
#include <memory>

#include "amontons/multibody/step/simulation.hpp"
#include "check.hpp"

using namespace amontons;

namespace {

std::shared_ptr<const Model> one_body(const Mat3& inertia, const Vec3& omega, const Vec3& centre = {},
                                      const Vec3& gravity = {}) {
  ModelDescription d;
  d.gravity = gravity;
  Body body;
  body.mass = 2;
  body.inertia = inertia;
  body.centre_of_mass = centre;
  body.angular_velocity = omega;
  d.bodies.push_back(body);
  return std::make_shared<Model>(d);
}

}  // namespace

// Breaks with any drift of the spin: the midpoint rule keeps energy and momentum exactly, so that only
// rounding is left, some 1e-16 per step. Spinning about the intermediate axis, the body tumbles
// (Dzhanibekov).
TEST(torque_free_top_keeps_momentum_and_energy) {
  const auto model = one_body(Mat3::diagonal(1, 2, 2.5), {0.01, 6.283, 0.02});
  SimulationOptions options;
  options.dt = 5e-3;
  Simulation sim(model, options);
  const Momentum before = momentum(*model, sim.state());
  const double energy = kinetic_energy(*model, sim.state());
  double turned = 1;
  for (int k = 0; k < 4000; ++k) {  // 20 revolutions
    sim.step();
    const State& state = sim.state();
    turned =
        std::min(turned, rotate(conjugate(state.orientations[0]), state.angular_velocities[0]).y / 6.283);
  }
  CHECK(turned < -0.9);  // it did tumble
  CHECK_NEAR(norm(momentum(*model, sim.state()).angular - before.angular), 0, 1e-11 * norm(before.angular));
  CHECK_NEAR(kinetic_energy(*model, sim.state()), energy, 1e-11 * energy);
}

// Breaks if the turn of a step is not exp(h omega) for a body that spins about a principal axis: after one
// second of one revolution per second it must be back, to rounding.
TEST(spin_about_a_principal_axis_is_exact) {
  const auto model = one_body(Mat3::diagonal(1, 2, 2.5), {0, 0, 2 * 3.14159265358979323846});
  SimulationOptions options;
  options.dt = 0.01;
  Simulation sim(model, options);
  for (int k = 0; k < 100; ++k) sim.step();
  CHECK_NEAR(norm(logarithm(sim.state().orientations[0])), 0, 1e-12);
}

// Second order: halving h divides the error of the orientation of a tumbling body by four. Breaks with a
// first-order gyroscopic torque.
TEST(tumbling_is_second_order) {
  const auto orientation = [](int steps) {
    Simulation sim(one_body(Mat3::diagonal(1, 2, 2.5), {1, 2, 3}), [&] {
      SimulationOptions options;
      options.dt = 1.0 / steps;
      return options;
    }());
    for (int k = 0; k < steps; ++k) sim.step();
    return sim.state().orientations[0];
  };
  const Quat exact = orientation(6400);
  const double coarse = norm(logarithm(conjugate(exact) * orientation(100)));
  const double fine = norm(logarithm(conjugate(exact) * orientation(200)));
  CHECK(coarse < 1e-3);
  CHECK(fine > 0 && coarse / fine > 3.8 && coarse / fine < 4.2);
}

// Several radians per step: still bounded, momentum still kept. Breaks with an explicit gyroscopic torque,
// which gains energy, and when the solve of the midpoint rule is cut short where it converges slowly.
TEST(spin_faster_than_the_step) {
  const auto model = one_body(Mat3::diagonal(1, 2, 2.5), {300, 500, 700});
  Simulation sim(model, {});
  const Momentum before = momentum(*model, sim.state());
  const double energy = kinetic_energy(*model, sim.state());
  for (int k = 0; k < 200; ++k) sim.step();
  CHECK_NEAR(norm(momentum(*model, sim.state()).angular - before.angular), 0, 1e-10 * norm(before.angular));
  CHECK_NEAR(kinetic_energy(*model, sim.state()), energy, 1e-10 * energy);
}

// The centre of mass of a spinning body whose frame lies elsewhere falls on the parabola, z_n = -g (n h)^2 /
// 2 exactly. Breaks if the offset leaks into the motion of the centre.
TEST(free_fall_with_an_offset_centre) {
  const Vec3 centre{0.3, -0.2, 0.1};
  const auto model = one_body(Mat3::diagonal(1, 2, 2.5), {1, 2, 3}, centre, {0, 0, -10});
  SimulationOptions options;
  options.dt = 0.01;
  Simulation sim(model, options);
  const Vec3 start = cross({1, 2, 3}, centre);
  for (int k = 0; k < 100; ++k) sim.step();
  const Vec3 now = Transform{sim.state().positions[0], sim.state().orientations[0]}(centre);
  const Vec3 expected = centre + 1.0 * start + Vec3{0, 0, -10 * 1e-4 * 100 * 100 / 2};
  CHECK_NEAR(norm(now - expected), 0, 1e-11);
}
