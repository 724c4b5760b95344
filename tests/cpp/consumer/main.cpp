#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "amontons/base/error.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "amontons/sets/product.hpp"

// Uses inline functions, compiled ones and exceptions of the installed library.
namespace {

bool projects() {
  amontons::SetProduct K;
  K.add_each<amontons::Friction>(std::vector<double>{0.5});
  const std::array<double, 3> x = {1.0, 3.0, 0.0};
  std::array<double, 3> foot{};
  amontons::project(K, x, foot);
  std::printf("projection of (1, 3, 0): (%g, %g, %g)\n", foot[0], foot[1], foot[2]);
  // The foot on the ray (1, mu)/sqrt(1 + mu^2): (1 + .5 * 3) / 1.25 * (1, .5) = (2, 1).
  return std::abs(foot[0] - 2) < 1e-12 && std::abs(foot[1] - 1) < 1e-12;
}

// A cube of 1 m and 2 kg on the floor.
amontons::ModelDescription cube_on_floor(double height) {
  amontons::ModelDescription d;
  amontons::Geom floor, shape;
  floor.shape = amontons::Plane{};
  shape.body = 0, shape.shape = amontons::Box{{0.5, 0.5, 0.5}};
  amontons::Body cube;
  cube.name = "cube", cube.mass = 2;
  cube.inertia = amontons::Mat3::diagonal(1 / 3.0, 1 / 3.0, 1 / 3.0);
  cube.pose.position = {0, 0, height};
  d.bodies = {cube}, d.geoms = {floor, shape};
  return d;
}

bool falls() {
  amontons::SimulationOptions options;
  options.dt = 0.01;
  amontons::Simulation simulation(std::make_shared<const amontons::Model>(cube_on_floor(1.5)), options);
  for (int k = 0; k < 20; ++k) simulation.step();
  // Free fall is exact: z = z0 - g t^2 / 2.
  const double z = simulation.state().positions[0].z, foreseen = 1.5 - 9.81 * 0.2 * 0.2 / 2;
  for (int k = 0; k < 80; ++k) simulation.step();
  double force = 0;
  for (const amontons::Contact& c : simulation.contacts()) force += c.impulse.z / options.dt;
  std::printf("falling cube at %.6f m, %zu contacts carry %.6f N\n", z, simulation.contacts().size(), force);
  // The tolerance of a step is 1e-6 of its weight.
  return std::abs(z - foreseen) < 1e-12 && std::abs(force - 2 * 9.81) < 1e-4;
}

bool refuses() {
  amontons::ModelDescription d = cube_on_floor(1);
  d.bodies[0].mass = -1;
  try {
    amontons::Model model(d);
  } catch (const amontons::InputError& error) {
    std::printf("refused: %s\n", error.what());
    return true;
  }
  return false;
}

}  // namespace

int main() { return projects() && falls() && refuses() ? 0 : 1; }
