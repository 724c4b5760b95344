// A hammer on a hinge falls against a block, which slides until friction has stopped it. knock.py is the same
// in Python and prints the same digits.
#include <algorithm>
#include <amontons.hpp>
#include <cstdio>

using namespace amontons;

int main() {
  try {
    const Material rubber{.friction = 0.4};
    ModelBuilder builder;  // gravity {0, 0, -9.81} m/s^2
    builder.add_floor(0, rubber);
    builder.add_body(
        "block",
        {.position = {0.21, 0, 0.1}, .shape = Box{{0.1, 0.1, 0.1}}, .density = 500, .material = rubber});
    // It lies level at first: its middle half a metre beside the hinge, a metre above the middle of the
    // block.
    builder.add_body(
        "hammer",
        {.position = {-0.5, 0, 1.1}, .shape = Box{{0.5, 0.05, 0.05}}, .density = 2000, .material = rubber});
    builder.add_revolute_joint("hammer", "world",
                               {.name = "hinge", .point = Vec3{0, 0, 1.1}, .axis = {0, 1, 0}});
    Simulation simulation(builder.build(), {.dt = 2e-3});
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
