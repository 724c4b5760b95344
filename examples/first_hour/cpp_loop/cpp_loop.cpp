// The first hour in C++: a pusher brings a box to 0.3 m before a wall, which it sees by a ray; then an arm
// from an MJCF file lowers its forearm with the hand to the floor. Python wrote the file:
// amontons.write_model(amontons.load_model("examples/models/arm.xml"), "arm.json").
#include <algorithm>
#include <amontons.hpp>
#include <cmath>
#include <cstdio>

using namespace amontons;

double push_box() {
  ModelBuilder builder;
  builder.add_floor();
  builder.add_geom("world", Box{{0.05, 1, 0.5}}, {.name = "wall", .position = {2, 0, 0.5}});
  builder.add_body("box", {.position = {0.3, 0, 0.1}, .shape = Box{{0.1, 0.1, 0.1}}, .density = 500});
  builder.add_body("pusher", {.position = {0, 0, 0.1}, .shape = Sphere{0.05}, .mass = 2});
  const Motor drive{.kind = MotorKind::velocity, .max_effort = 100};  // N
  builder.add_prismatic_joint("pusher", "world",
                              {.name = "rail", .axis = {1, 0, 0}, .dof = {.motor = drive}});
  Simulation simulation(builder.build(), {.dt = 2e-3});
  const Model& model = simulation.model();
  const Index box = model.body_index("box"), pusher = model.body_index("pusher");
  const Index rail = model.control_index("rail");
  double gap = 0;
  while (simulation.state().time < 5 - 1e-9) {
    const GeomHit ahead = simulation.ray(simulation.state().positions[box], {1, 0, 0}, {"box"});
    gap = ahead.geom == model.geom_index("wall") ? ahead.hit.distance - 0.1 : infinity;
    simulation.state().controls[rail] = std::clamp(3 * (gap - 0.3), 0.0, 0.5);  // m/s
    simulation.step();
    for (const GeomPair& pair : simulation.contact_events().began)
      if (pair.body_a == pusher || pair.body_b == pusher)
        std::printf("t %.3f s  the pusher meets the box with %.1f N\n", simulation.state().time,
                    -simulation.contact_force("pusher").x);
  }
  std::printf("the box stands %.3f m before the wall\n", gap);
  return gap;
}

double lower_hand(const char* file) {
  Simulation simulation(Model::from_json(file), {.dt = 2e-3});
  const Index shoulder = simulation.model().control_index("shoulder");
  double& angle = simulation.state().controls[shoulder];
  while (simulation.contacts_between("forearm", "world").empty() && simulation.state().time < 5) {
    angle += 0.5 * simulation.options().dt;  // rad
    simulation.step();
  }
  const double reached = simulation.state().coordinates[simulation.model().dof_index("shoulder")];
  std::printf("the hand touches the floor at %.3f rad\n", reached);
  return reached;
}

int main(int, char** arguments) {
  try {
    return std::abs(push_box() - 0.3) < 5e-3 && lower_hand(arguments[1]) > 0.8 ? 0 : 1;
  } catch (const InputError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  }
}
