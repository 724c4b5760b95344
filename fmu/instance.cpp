#include "instance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "amontons/base/error.hpp"
#include "amontons/multibody/model/state_bytes.hpp"

namespace amontons::fmu {
namespace {

using Json = nlohmann::json;

constexpr std::pair<const char*, Kind> kinds[] = {
    {"time", Kind::time},
    {"control", Kind::control},
    {"body_load", Kind::body_load},
    {"joint_force", Kind::joint_force},
    {"q", Kind::q},
    {"qd", Kind::qd},
    {"frame", Kind::frame},
    {"reaction", Kind::reaction},
    {"contacts", Kind::contacts},
    {"contact_force", Kind::contact_force},
    {"sensor", Kind::sensor},
    {"effort", Kind::effort},
    {"actuator", Kind::actuator},
    {"began", Kind::began},
    {"ended", Kind::ended},
    {"missed", Kind::missed},
};

// The file that amontons.write_fmu made beside the model.
Json description_in(const std::filesystem::path& resources) {
  std::ifstream stream(resources / "fmu.json", std::ios::binary);
  AMONTONS_REQUIRE(stream.is_open(), "fmu.json is not in the resources of the unit");
  Json found = Json::parse(stream, nullptr, false);
  AMONTONS_REQUIRE(found.is_object() && found.value("version", 0) == 1,
                   "fmu.json of the resources is damaged or of another version");
  return found;
}

SimulationOptions options_of(const Json& given) {
  SimulationOptions o;
  o.dt = given.value("dt", o.dt);
  o.law = given.value("law", "coulomb") == "associated" ? Law::associated : Law::coulomb;
  o.method = given.value("method", o.method);
  o.tolerance = given.value("tolerance", o.tolerance);
  o.max_iterations = given.value("max_iterations", o.max_iterations);
  o.threads = given.value("threads", 1U);
  o.margin = given.value("margin", o.margin);
  o.recovery =
      given.value("recovery", "projection") == "velocity" ? Recovery::velocity : Recovery::projection;
  o.recovery_speed = given.value("recovery_speed", o.recovery_speed);
  o.restitution_speed = given.value("restitution_speed", o.restitution_speed);
  o.warm_start = given.value("warm_start", o.warm_start);
  o.max_substeps = given.value("max_substeps", o.max_substeps);
  return o;
}

void read(const Json& from, std::vector<Vec3>& to) {
  const auto rows = from.get<std::vector<std::array<double, 3>>>();
  AMONTONS_REQUIRE(rows.size() == to.size(), "fmu.json: the start is that of another model");
  for (std::size_t i = 0; i < rows.size(); ++i) to[i] = {rows[i][0], rows[i][1], rows[i][2]};
}
void read(const Json& from, std::vector<Quat>& to) {
  const auto rows = from.get<std::vector<std::array<double, 4>>>();
  AMONTONS_REQUIRE(rows.size() == to.size(), "fmu.json: the start is that of another model");
  for (std::size_t i = 0; i < rows.size(); ++i) to[i] = {rows[i][0], rows[i][1], rows[i][2], rows[i][3]};
}
void read(const Json& from, std::vector<double>& to) {
  auto found = from.get<std::vector<double>>();
  AMONTONS_REQUIRE(found.size() == to.size(), "fmu.json: the start is that of another model");
  to = std::move(found);
}

// Where the simulation begins, with what acts on it.
void read_start(const Json& from, State& to) {
  read(from.at("positions"), to.positions);
  read(from.at("orientations"), to.orientations);
  read(from.at("linear_velocities"), to.linear_velocities);
  read(from.at("angular_velocities"), to.angular_velocities);
  read(from.at("forces"), to.forces);
  read(from.at("torques"), to.torques);
  read(from.at("joint_coordinates"), to.coordinates);
  read(from.at("joint_forces"), to.joint_forces);
  read(from.at("controls"), to.controls);
  read(from.at("activations"), to.activations);
}

Kind kind_of(const std::string& name) {
  for (const auto& [known, kind] : kinds)
    if (name == known) return kind;
  throw InputError("fmu.json: there is no kind of variable \"" + name + "\"");
}

// How many entries of a kind there are, and how many parts each has. Sensors differ in their parts.
std::pair<std::size_t, std::size_t> size_of(Kind kind, const Simulation& s, std::size_t frames) {
  switch (kind) {
    case Kind::control:
      return {s.state().controls.size(), 1};
    case Kind::joint_force:
      return {s.state().joint_forces.size(), 1};
    case Kind::body_load:
      return {s.model().bodies(), 6};
    case Kind::q:
      return {s.tree().nq(), 1};
    case Kind::qd:
      return {s.tree().nv(), 1};
    case Kind::frame:
      return {frames, 13};
    case Kind::reaction:
      return {s.model().joints(), 6};
    case Kind::contact_force:
      return {s.model().bodies(), 3};
    case Kind::effort:
      return {s.model().dofs(), 4};
    case Kind::actuator:
      return {s.model().description().actuators.size(), 1};
    default:
      return {1, 1};
  }
}

std::string name_of(std::uint32_t reference) { return "value reference " + std::to_string(reference); }

}  // namespace

Instance::Instance(const std::filesystem::path& resources)
    : simulation_(Model::from_json(resources / "model.json"),
                  options_of(description_in(resources).value("options", Json::object()))) {
  try {
    const Json given = description_in(resources);
    for (const Json& f : given.at("frames")) {
      const auto p = f.at("position").get<std::array<double, 3>>();
      const auto r = f.at("rotation").get<std::array<double, 4>>();
      const Index body = f.at("body").get<Index>();
      AMONTONS_REQUIRE(body >= world && body < static_cast<Index>(simulation_.model().bodies()),
                       "fmu.json: a frame names a body that the model has not");
      frames_.push_back({body, {{p[0], p[1], p[2]}, {r[0], r[1], r[2], r[3]}}});
    }
    sensors_ =
        read_sensors(given.value("sensors", Json::array()), given.value("volumes", Json()), simulation_);
    for (const Json& v : given.at("variables")) {
      const Variable read{kind_of(v.at(0).get<std::string>()), v.at(1).get<std::size_t>(),
                          v.at(2).get<std::size_t>()};
      auto [entries, parts] = size_of(read.kind, simulation_, frames_.size());
      if (read.kind == Kind::sensor) {
        entries = sensors_.size();
        parts = read.index < entries ? sensors_[read.index].size : 0;
      }
      AMONTONS_REQUIRE(read.index < entries && read.part < parts,
                       "fmu.json: a variable names a part that the model has not");
      variables_.push_back(read);
    }
    read_start(given.at("start"), simulation_.state());
    start_ = simulation_.state();
  } catch (const Json::exception& error) {
    throw InputError(std::string("fmu.json: ") + error.what());
  }
  reset();
}

void Instance::reset() {
  simulation_.reset();
  simulation_.state() = start_;
  record_ = {};
  note_loads();
  coordinates_ = {};
}

const Variable& Instance::variable(std::uint32_t reference) const {
  AMONTONS_REQUIRE(reference < variables_.size(), name_of(reference) + " is not one of the unit");
  return variables_[reference];
}

bool Instance::is_integer(std::uint32_t reference) const {
  const Kind kind = variable(reference).kind;
  return kind == Kind::contacts || kind == Kind::began || kind == Kind::ended || kind == Kind::missed;
}

double Instance::coordinate(const Variable& v) const {
  if (coordinates_.q.empty()) coordinates_ = read_coordinates(simulation_.tree(), simulation_.state());
  return (v.kind == Kind::q ? coordinates_.q : coordinates_.qd)[v.index];
}

double Instance::effort(const Variable& v) const {
  const State& s = simulation_.state();
  const double time = s.impulse_step > 0 ? s.impulse_step : 1.0;
  if (v.kind == Kind::actuator) return s.actuator_impulses[v.index] / time;
  const DofImpulse& impulse = s.dof_impulses[v.index];
  if (v.part > 0) return std::array{impulse.passive, impulse.friction, impulse.limit}[v.part - 1] / time;
  // The impulse of an actuator is along its length.
  double motor = impulse.motor;
  const Model& model = simulation_.model();
  for (Index a : model.actuators_of_dof(v.index)) {
    const auto k = static_cast<std::size_t>(a);
    motor += model.description().actuators[k].transmission.gear * s.actuator_impulses[k];
  }
  return motor / time;
}

double Instance::of_frame(const Frame& frame, std::size_t part) const {
  const State& s = simulation_.state();
  const auto body = static_cast<std::size_t>(frame.body);
  const bool fixed = frame.body == world;
  const Transform carrier =
      fixed ? Transform{{}, {1, 0, 0, 0}} : Transform{s.positions[body], s.orientations[body]};
  const Transform pose = carrier * frame.pose;
  if (part < 3) return pose.position[static_cast<int>(part)];
  const Quat& r = pose.rotation;
  if (part < 7) return std::array{r.w, r.x, r.y, r.z}[part - 3];
  if (fixed) return 0;
  const Vec3& spin = s.angular_velocities[body];
  if (part >= 10) return spin[static_cast<int>(part - 10)];
  const Vec3 speed = s.linear_velocities[body] + cross(spin, pose.position - carrier.position);
  return speed[static_cast<int>(part - 7)];
}

double Instance::value(std::uint32_t reference) const {
  const Variable& v = variable(reference);
  const State& s = simulation_.state();
  switch (v.kind) {
    case Kind::time:
      return s.time;
    case Kind::control:
      return s.controls[v.index];
    case Kind::joint_force:
      return s.joint_forces[v.index];
    case Kind::body_load:
      return (v.part < 3 ? s.forces : s.torques)[v.index][static_cast<int>(v.part % 3)];
    case Kind::q:
    case Kind::qd:
      return coordinate(v);
    case Kind::frame:
      return of_frame(frames_[v.index], v.part);
    case Kind::reaction:
      return record_.loads[6 * v.index + v.part];
    case Kind::contact_force:
      return record_.loads[6 * simulation_.model().joints() + 3 * v.index + v.part];
    case Kind::sensor:
      return record_.loads[first_sensor() + sensors_[v.index].first + v.part];
    case Kind::effort:
    case Kind::actuator:
      return effort(v);
    case Kind::contacts:
      return record_.contacts;
    case Kind::began:
      return record_.began;
    case Kind::ended:
      return record_.ended;
    case Kind::missed:
      return record_.missed;
  }
  return 0;
}

void Instance::set(std::uint32_t reference, double value) {
  const Variable& v = variable(reference);
  AMONTONS_REQUIRE(std::isfinite(value), name_of(reference) + ": the value is not finite");
  State& s = simulation_.state();
  switch (v.kind) {
    case Kind::control:
      s.controls[v.index] = value;
      return;
    case Kind::joint_force:
      s.joint_forces[v.index] = value;
      return;
    case Kind::body_load:
      (v.part < 3 ? s.forces : s.torques)[v.index][static_cast<int>(v.part % 3)] = value;
      return;
    default:
      throw InputError(name_of(reference) + " is no input");
  }
}

Instance::Advance Instance::advance(double point, double size, bool return_early) {
  const double dt = simulation_.options().dt;
  const double steps = std::round(size / dt);
  // Times that importers add up, or multiply, differ by rounding.
  AMONTONS_REQUIRE(std::abs(point - time()) < dt / 4,
                   "the unit is at t = " + std::to_string(time()) + " s, and not at the communication point");
  AMONTONS_REQUIRE(steps >= 1 && steps < 1e9 && std::abs(size - steps * dt) < 1e-6 * dt * steps,
                   "the communication step is no multiple of the time step " + std::to_string(dt) + " s");
  Advance result;
  for (auto left = static_cast<std::size_t>(steps); left > 0; --left) {
    const Report report = simulation_.step();
    coordinates_ = {};
    if (!report.advanced) {
      result.stopped = true;
      result.message = "a step at t = " + std::to_string(time()) + " s had velocities that are not finite";
      return result;
    }
    note_step(report);
    if (report.is_sound()) continue;
    result.missed = true;
    result.message = "the step to t = " + std::to_string(time()) + " s missed its tolerance";
    if (return_early && left > 1) {
      result.early = true;
      return result;
    }
  }
  return result;
}

void Instance::note_step(const Report& report) {
  std::vector<GeomPair> now;
  for (const Contact& c : simulation_.contacts())
    if (!(c.impulse == Vec3{})) now.push_back({c.body_a, c.body_b, c.geom_a, c.geom_b});
  std::sort(now.begin(), now.end());
  now.erase(std::unique(now.begin(), now.end()), now.end());
  const auto only_in = [](const auto& these, const auto& those) {
    std::vector<GeomPair> rest;
    std::set_difference(these.begin(), these.end(), those.begin(), those.end(), std::back_inserter(rest));
    return static_cast<std::int32_t>(rest.size());
  };
  record_.began += only_in(now, record_.touching);
  record_.ended += only_in(record_.touching, now);
  record_.touching = std::move(now);
  record_.contacts = static_cast<std::int32_t>(report.contacts);
  record_.missed += report.is_sound() ? 0 : 1;
  note_loads();
}

void Instance::note_loads() {
  const std::size_t joints = simulation_.model().joints(), bodies = simulation_.model().bodies();
  record_.loads.assign(first_sensor() + values_of(sensors_), 0.0);
  read_all(simulation_, sensors_, record_.loads.data() + first_sensor());
  const double step = simulation_.state().impulse_step;
  if (!(step > 0)) return;
  const auto& reactions = simulation_.joint_reactions();
  for (std::size_t j = 0; j < reactions.size(); ++j)
    for (int k = 0; k < 3; ++k) {
      record_.loads[6 * j + static_cast<std::size_t>(k)] = reactions[j].impulse[k] / step;
      record_.loads[6 * j + 3 + static_cast<std::size_t>(k)] = reactions[j].angular[k] / step;
    }
  std::vector<Vec3> impulses(bodies);
  for (const Contact& c : simulation_.contacts()) {
    if (c.body_a >= 0) impulses[static_cast<std::size_t>(c.body_a)] += c.impulse;
    if (c.body_b >= 0) impulses[static_cast<std::size_t>(c.body_b)] += -c.impulse;
  }
  for (std::size_t b = 0; b < bodies; ++b)
    for (int k = 0; k < 3; ++k)
      record_.loads[6 * joints + 3 * b + static_cast<std::size_t>(k)] = impulses[b][k] / step;
}

void Instance::restore(const Memory& memory) {
  simulation_.state() = memory.state;
  record_ = memory.record;
  coordinates_ = {};
}

namespace {

// Numbers of fixed size at the begin of the bytes of a Memory; state, pairs and loads follow.
struct Head {
  std::uint64_t state = 0, pairs = 0, loads = 0;
  std::int32_t contacts = 0, began = 0, ended = 0, missed = 0;
};

template <class T>
std::span<const std::byte> bytes_of(const std::vector<T>& list) {
  return std::as_bytes(std::span(list));
}

}  // namespace

std::vector<std::byte> to_bytes(const Memory& memory) {
  const std::vector<std::byte> state = state_to_bytes(memory.state);
  const Record& r = memory.record;
  const Head head{state.size(), r.touching.size(), r.loads.size(), r.contacts, r.began, r.ended, r.missed};
  std::vector<std::byte> bytes;
  for (const auto part :
       {std::as_bytes(std::span(&head, 1)), bytes_of(state), bytes_of(r.touching), bytes_of(r.loads)})
    bytes.insert(bytes.end(), part.begin(), part.end());
  return bytes;
}

Memory Instance::from_bytes(std::span<const std::byte> bytes) const {
  const char* const wrong = "the serialised state is cut off, or of another unit";
  Head head;
  AMONTONS_REQUIRE(bytes.size() >= sizeof head, wrong);
  std::memcpy(&head, bytes.data(), sizeof head);
  bytes = bytes.subspan(sizeof head);
  const std::size_t loads = record_.loads.size() * sizeof(double);
  AMONTONS_REQUIRE(head.loads == record_.loads.size() && head.state <= bytes.size() &&
                       head.pairs <= bytes.size() / sizeof(GeomPair) &&
                       head.state + head.pairs * sizeof(GeomPair) + loads == bytes.size(),
                   wrong);
  Memory memory = this->memory();
  state_from_bytes(bytes.first(head.state), memory.state);
  memory.record.contacts = head.contacts;
  memory.record.began = head.began;
  memory.record.ended = head.ended;
  memory.record.missed = head.missed;
  memory.record.touching.resize(head.pairs);
  bytes = bytes.subspan(head.state);
  if (head.pairs > 0) std::memcpy(memory.record.touching.data(), bytes.data(), head.pairs * sizeof(GeomPair));
  if (loads > 0) std::memcpy(memory.record.loads.data(), bytes.last(loads).data(), loads);
  return memory;
}

}  // namespace amontons::fmu
