// A hammer on a hinge falls against a block, which slides until friction has stopped it. knock.py is the same
// in Python and prints the same digits.
#include <algorithm>
#include <cstdio>
#include <memory>

#include "amontons/base/error.hpp"
#include "amontons/multibody/step/simulation.hpp"

using namespace amontons;

namespace {

// A solid box with a shape of its own: mass (kg) and inertia (kg m^2) follow from the density (kg/m^3).
Index add_box(ModelDescription& scene, const char* name, const Vec3& half, double density,
              const Transform& pose) {
  Body body;
  body.name = name;
  const double volume = 8 * half.x * half.y * half.z, xx = half.x * half.x, yy = half.y * half.y,
               zz = half.z * half.z;
  body.mass = volume * density;
  const double third = volume / 3;
  body.inertia =
      Mat3::diagonal(third * (yy + zz) * density, third * (xx + zz) * density, third * (xx + yy) * density);
  body.pose = pose;
  Geom geom;
  geom.body = static_cast<Index>(scene.bodies.size());
  geom.name = name, geom.shape = Box{half};
  geom.material.friction = 0.4;
  scene.bodies.push_back(body);
  scene.geoms.push_back(geom);
  return geom.body;
}

ModelDescription scene() {
  ModelDescription scene;  // gravity {0, 0, -9.81} m/s^2
  Geom floor;
  floor.name = "floor", floor.shape = Plane{};
  floor.material.friction = 0.4;
  scene.geoms.push_back(floor);
  add_box(scene, "block", {0.1, 0.1, 0.1}, 500, {{0.21, 0, 0.1}, {}});
  // The hammer lies level at first: its middle half a metre beside the hinge.
  const Index hammer = add_box(scene, "hammer", {0.5, 0.05, 0.05}, 2000, {{-0.5, 0, 1.1}, {}});
  Joint hinge;  // about y, a metre above the middle of the block
  hinge.name = "hinge";
  hinge.body_a = hammer;
  hinge.frame_a.position = {0.5, 0, 0}, hinge.frame_b.position = {0, 0, 1.1};
  Dof turn;
  turn.axis = {0, 1, 0};
  hinge.dofs.push_back(turn);
  scene.joints.push_back(hinge);
  return scene;
}

}  // namespace

int main() {
  try {
    SimulationOptions options;
    options.dt = 2e-3;
    Simulation simulation(std::make_shared<const Model>(scene()), options);
    double worst = 0;
    for (int k = 0; k < 1000; ++k) {
      const Report report = simulation.step();
      worst = std::max(worst, report.residual);
      if (k % 100 != 99) continue;
      const Vec3& p = simulation.state().positions[0];
      std::printf("t %.1f s  block %.17g %.17g  energy %.17g  contacts %zu\n", report.time, p.x, p.z,
                  report.kinetic_energy, static_cast<std::size_t>(report.contacts));
    }
    return worst <= 1e-6 ? 0 : 1;
  } catch (const InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
