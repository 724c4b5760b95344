// The library in a page: functions of C that JavaScript calls, over the memory of WebAssembly. `make
// playground` builds it, playground/world.js calls it.
//
// A function that can fail returns 0 or null then, and message() says why. Arrays belong to the world: they
// are valid until the same function is called again, or memory grows.
#include <emscripten.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "amontons.hpp"

#define EXPORTED EMSCRIPTEN_KEEPALIVE

namespace {

using namespace amontons;

// A spring between a point of a body and the pointer.
struct Pull {
  Index body = -1;
  Vec3 point, target;  // point in body axes, from the origin of the body; target in world axes, m
};

struct World {
  std::unique_ptr<Simulation> simulation;
  std::vector<double> connected;  // per body, mass of all that joints connect with it, kg
  Report report;
  Pull pull;
  std::vector<double> poses, velocities, forces, numbers;
};

std::string last_message;

// f(), whose errors become the message.
template <class F>
auto guarded(F&& f) -> decltype(f()) {
  try {
    return f();
  } catch (const std::exception& error) {
    last_message = error.what();
    return {};
  }
}

void append(std::vector<double>& out, const Vec3& v) { out.insert(out.end(), {v.x, v.y, v.z}); }

bool is_dynamic(const Body& body) { return body.motion == Motion::dynamic; }

// A body that others hang on by joints needs a spring for the mass of all.
std::vector<double> connected_masses(const ModelDescription& d) {
  std::vector<std::size_t> group(d.bodies.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  const auto root = [&](Index body) {
    std::size_t b = static_cast<std::size_t>(body);
    while (group[b] != b) b = group[b] = group[group[b]];
    return b;
  };
  const auto moves = [&](Index body) {
    return body >= 0 && is_dynamic(d.bodies[static_cast<std::size_t>(body)]);
  };
  for (const Joint& joint : d.joints)
    if (moves(joint.body_a) && moves(joint.body_b)) group[root(joint.body_a)] = root(joint.body_b);
  std::vector<double> sum(group.size()), mass;
  for (std::size_t i = 0; i < group.size(); ++i)
    if (is_dynamic(d.bodies[i])) sum[root(static_cast<Index>(i))] += d.bodies[i].mass;
  for (std::size_t i = 0; i < group.size(); ++i) mass.push_back(sum[root(static_cast<Index>(i))]);
  return mass;
}

// An upper bound of the velocity (m/s) that an impulse of 1 N s at the arm r, from the centre of mass in body
// axes, gives its point in any direction: the largest eigenvalue of 1/m - [r] J^-1 [r] is at most 1/m plus
// the trace of the second part.
double lightness(const Body& body, const Vec3& r) {
  const Mat3 turning = inverse(body.inertia);
  double trace = 0;
  for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}}) {
    const Vec3 moment = cross(r, axis);
    trace += dot(moment, turning * moment);
  }
  return 1 / body.mass + trace;
}

// Holds the load k d - c v of the spring during the next step, and the weight of the body beside it. k gives
// the connected mass a frequency of 1.5 Hz, and c damps critically. A load is that of the start of the step,
// so both stay below a tenth of what would overshoot within it.
void load_spring(World& w) {
  State& s = w.simulation->state();
  std::fill(s.forces.begin(), s.forces.end(), Vec3{});
  std::fill(s.torques.begin(), s.torques.end(), Vec3{});
  if (w.pull.body < 0) return;
  const std::size_t b = static_cast<std::size_t>(w.pull.body);
  const ModelDescription& d = w.simulation->model().description();
  const Body& body = d.bodies[b];
  constexpr double omega = 9.4, share = 0.1;  // rad/s; 1
  const double h = w.simulation->options().dt, mass = w.connected[b];
  const double heaviest = share / lightness(body, w.pull.point - body.centre_of_mass);
  const double k = std::min(mass * omega * omega, heaviest / (h * h));
  const double c = std::min(2 * mass * omega, heaviest / h);
  const Vec3 arm = rotate(s.orientations[b], w.pull.point);
  const Vec3 velocity = s.linear_velocities[b] + cross(s.angular_velocities[b], arm);
  const Vec3 force = k * (w.pull.target - s.positions[b] - arm) - c * velocity;
  s.forces[b] = force - body.mass * body.gravity_scale * d.gravity;
  s.torques[b] = cross(arm - rotate(s.orientations[b], body.centre_of_mass), force);
}

// Another model of the same bodies, or other options, from the same state on.
void replace(World& w, ModelDescription description, const SimulationOptions& options) {
  auto next = std::make_unique<Simulation>(Model(std::move(description)), options);
  next->state() = w.simulation->state();
  w.simulation = std::move(next);
}

}  // namespace

extern "C" {

EXPORTED const char* message() { return last_message.c_str(); }

// A model as JSON; dt (s), tolerance (natural residual).
EXPORTED World* open_world(const char* json, double dt, double tolerance) {
  return guarded([&]() -> World* {
    auto world = std::make_unique<World>();
    Model model(read_model_json(json));
    world->connected = connected_masses(model.description());
    const SimulationOptions options{.dt = dt, .tolerance = tolerance, .threads = 1};
    world->simulation = std::make_unique<Simulation>(std::move(model), options);
    return world.release();
  });
}

EXPORTED void close_world(World* world) { delete world; }

// Back to the initial state, with the present options and materials.
EXPORTED void reset_world(World* w) {
  w->simulation->reset();
  w->report = {};
  w->pull = {};
}

// Makes one step; 1 if the state moved on. Velocities that are not finite give 0 without a message.
EXPORTED int step_world(World* w) {
  last_message.clear();
  return guarded([&]() -> int {
    load_spring(*w);
    w->report = w->simulation->step();
    return w->report.advanced;
  });
}

EXPORTED int set_options(World* w, double dt, double tolerance) {
  return guarded([&]() -> int {
    SimulationOptions options = w->simulation->options();
    options.dt = dt;
    options.tolerance = tolerance;
    replace(*w, w->simulation->model().description(), options);
    return 1;
  });
}

// Coefficients of all surfaces: friction in all directions, moving or not; restitution.
EXPORTED int set_material(World* w, double friction, double restitution) {
  return guarded([&]() -> int {
    ModelDescription description = w->simulation->model().description();
    const auto change = [&](Material& material) {
      material.friction = friction;
      material.friction_across = material.friction_static = -1;
      material.restitution = restitution;
    };
    for (Geom& geom : description.geoms) change(geom.material);
    for (PairMaterial& pair : description.pair_materials) change(pair.material);
    replace(*w, std::move(description), w->simulation->options());
    return 1;
  });
}

// Takes a body at a point (m, world), which pull_to draws to another; 0 if it does not move freely. Body -1
// lets go.
EXPORTED int pull_body(World* w, int body, double x, double y, double z) {
  w->pull = {};
  const auto& bodies = w->simulation->model().description().bodies;
  if (body < 0 || body >= static_cast<int>(bodies.size()) ||
      !is_dynamic(bodies[static_cast<std::size_t>(body)]))
    return 0;
  const State& s = w->simulation->state();
  const Vec3 target{x, y, z};
  w->pull = {body,
             rotate(conjugate(s.orientations[static_cast<std::size_t>(body)]),
                    target - s.positions[static_cast<std::size_t>(body)]),
             target};
  return 1;
}
EXPORTED void pull_to(World* w, double x, double y, double z) { w->pull.target = {x, y, z}; }

EXPORTED int count_bodies(const World* w) { return static_cast<int>(w->simulation->model().bodies()); }
// Seven numbers per body: position (m), orientation (w, x, y, z).
EXPORTED const double* body_poses(World* w) {
  w->poses.clear();
  const State& state = w->simulation->state();
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    const Quat& q = state.orientations[i];
    append(w->poses, state.positions[i]);
    w->poses.insert(w->poses.end(), {q.w, q.x, q.y, q.z});
  }
  return w->poses.data();
}
// Six numbers per body: linear velocity (m/s), angular velocity (rad/s), world axes.
EXPORTED const double* body_velocities(World* w) {
  w->velocities.clear();
  const State& state = w->simulation->state();
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    append(w->velocities, state.linear_velocities[i]);
    append(w->velocities, state.angular_velocities[i]);
  }
  return w->velocities.data();
}

// The number of contacts that carried a force in the last step.
EXPORTED int count_forces(World* w) {
  w->forces.clear();
  const double dt = w->simulation->options().dt;
  for (const Contact& c : w->simulation->contacts()) {
    if (c.impulse == Vec3{}) continue;
    append(w->forces, c.point);
    append(w->forces, c.impulse / dt);
  }
  return static_cast<int>(w->forces.size() / 6);
}
// Six numbers for each of the last count: point (m), force on the first body (N), world axes.
EXPORTED const double* contact_forces(const World* w) { return w->forces.data(); }

// Of the last step: time (s), residual, whether it is sound, iterations, contacts, largest penetration (m).
EXPORTED const double* last_report(World* w) {
  const Report& r = w->report;
  w->numbers = {r.time,
                r.residual,
                r.is_sound() ? 1.0 : 0.0,
                static_cast<double>(r.iterations),
                static_cast<double>(r.contacts),
                r.penetration};
  return w->numbers.data();
}

}  // extern "C"
