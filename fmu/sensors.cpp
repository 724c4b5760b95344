#include "sensors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>

#include "amontons/base/error.hpp"
#include "amontons/multibody/joints/actuators.hpp"
#include "amontons/multibody/kinematics/dynamics.hpp"
#include "amontons/multibody/kinematics/tree.hpp"
#include "amontons/multibody/model/model_json.hpp"

namespace amontons::fmu {

// A simulation between two steps, with what several sensors need.
struct SensorMoment {
  explicit SensorMoment(const Simulation& s);

  const Simulation& simulation;
  double time;  // s, over which the impulses of the last step acted
  Coordinates coordinates;
  TreeMotion motion;
  std::vector<BodyMomentum> momenta;
  std::vector<LineState> tendons, actuators;
};

namespace {

using Json = nlohmann::json;

}  // namespace

SensorMoment::SensorMoment(const Simulation& s)
    : simulation(s),
      time(s.state().impulse_step > 0 ? s.state().impulse_step : 1.0),
      coordinates(read_coordinates(s.tree(), s.state())) {
  const std::vector<double> rates = s.accelerations();
  const TreePose pose = pose_of(s.tree(), s.state(), coordinates.q);
  motion = motion_of(s.tree(), s.state(), pose, coordinates.qd, rates);
  momenta = body_momenta(s.tree(), s.state(), pose, coordinates.qd, rates);
  const ModelDescription& d = s.model().description();
  if (!d.tendons.empty()) tendons = tendon_lines(s.model(), s.state());
  if (!d.actuators.empty()) actuators = actuator_lines(s.model(), s.state());
}

namespace {

using Moment = SensorMoment;

// A frame on a body in the world, and its motion.
struct Moving {
  Transform pose;
  Vec3 velocity, spin, acceleration, turning;
  Vec3 local(const Vec3& v) const { return rotate(conjugate(pose.rotation), v); }
};

Moving moving(const Moment& m, Index body, const Transform& frame) {
  if (body == world) return {frame, {}, {}, {}, {}};
  const State& s = m.simulation.state();
  const auto b = static_cast<std::size_t>(body);
  const Transform pose = Transform{s.positions[b], s.orientations[b]} * frame;
  const Twist &v = m.motion.velocities[b], &a = m.motion.accelerations[b];
  const Vec3 velocity = velocity_at(v, pose.position);
  // That of the particle there: the spatial acceleration is that of the flow.
  return {pose, velocity, v.angular, velocity_at(a, pose.position) + cross(v.angular, velocity), a.angular};
}

Moving at(const Moment& m, const Sensor& s) { return moving(m, s.body, s.frame); }
Moving seen_from(const Moment& m, const Sensor& s) { return moving(m, s.reference, s.reference_frame); }

void put(double* to, const Vec3& v) { std::tie(to[0], to[1], to[2]) = std::make_tuple(v.x, v.y, v.z); }

Vec3 felt(const Moment& m, const Moving& frame) {
  return frame.acceleration - m.simulation.model().description().gravity;
}

// At a site, in its axes.
void accelerometer(const Moment& m, const Sensor& s, double* to) {
  const Moving frame = at(m, s);
  put(to, frame.local(felt(m, frame)));
}
void velocimeter(const Moment& m, const Sensor& s, double* to) {
  const Moving frame = at(m, s);
  put(to, frame.local(frame.velocity));
}
void gyro(const Moment& m, const Sensor& s, double* to) {
  const Moving frame = at(m, s);
  put(to, frame.local(frame.spin));
}
void magnetometer(const Moment& m, const Sensor& s, double* to) { put(to, at(m, s).local(s.field)); }

// What the motion of the bodies that hang on a sensor asks for, less loads, contacts and loops: the force and
// its moment about the world's origin that come from their carrier.
Twist from_carrier(const Moment& m, const Sensor& s) {
  const State& state = m.simulation.state();
  const ModelDescription& d = m.simulation.model().description();
  std::vector<double> inside(d.bodies.size() + 1);  // the world is the last
  const auto share = [&](Index b) {
    return inside[b == world ? d.bodies.size() : static_cast<std::size_t>(b)];
  };
  Twist left{};
  for (Index b : s.bodies) {
    const auto k = static_cast<std::size_t>(b);
    inside[k] = 1;
    left.linear += m.momenta[k].force.linear;
    left.angular += m.momenta[k].force.angular;
    if (d.bodies[k].motion != Motion::dynamic) continue;
    left.linear -= state.forces[k];
    left.angular -= state.torques[k] + cross(m.momenta[k].centre, state.forces[k]);
  }
  const auto take = [&](Index a, Index b, const Vec3& point, const Vec3& impulse, const Vec3& angular) {
    const double sign = (share(a) - share(b)) / m.time;
    left.linear -= sign * impulse;
    left.angular -= sign * (cross(point, impulse) + angular);
  };
  for (const Contact& c : m.simulation.contacts())
    take(c.body_a, c.body_b, c.point, c.impulse, c.angular_impulse);
  const auto& reactions = m.simulation.joint_reactions();
  for (Index j : m.simulation.tree().loops()) {
    const auto k = static_cast<std::size_t>(j);
    if (k >= reactions.size()) continue;  // before the first step
    take(d.joints[k].body_a, d.joints[k].body_b, reactions[k].point, reactions[k].impulse,
         reactions[k].angular);
  }
  return left;
}
void force(const Moment& m, const Sensor& s, double* to) {
  put(to, at(m, s).local(from_carrier(m, s).linear));
}
void torque(const Moment& m, const Sensor& s, double* to) {
  const Moving frame = at(m, s);
  const Twist w = from_carrier(m, s);
  put(to, frame.local(w.angular - cross(frame.pose.position, w.linear)));
}

// Normal forces on the link whose line into it passes through the volume.
void touch(const Moment& m, const Sensor& s, double* to) {
  const Moving frame = at(m, s);
  *to = 0;
  for (const Contact& c : m.simulation.contacts()) {
    const double sign =
        double(s.own[static_cast<std::size_t>(c.geom_a)]) - double(s.own[static_cast<std::size_t>(c.geom_b)]);
    const double normal = dot(c.impulse, c.normal) / m.time;
    if (sign == 0 || !(normal > 0)) continue;
    const Ray line{frame.local(c.point - frame.pose.position), frame.local(sign * c.normal)};
    if (!s.volume || std::isfinite(cast_ray(*s.volume, line).distance)) *to += normal;
  }
}

void rangefinder(const Moment& m, const Sensor& s, double* to) {
  const Moving frame = at(m, s);
  const Vec3 along = to_matrix(frame.pose.rotation).column(2);
  const GeomHit hit =
      cast_ray(m.simulation.model(), m.simulation.state(), {frame.pose.position, along}, s.own);
  *to = hit.geom < 0 ? -1.0 : hit.hit.distance;
}

void position(const Moment& m, const Sensor& s, double* to) { *to = m.coordinates.q[s.index]; }
void rate(const Moment& m, const Sensor& s, double* to) { *to = m.coordinates.qd[s.rate]; }
void ball(const Moment& m, const Sensor& s, double* to) {
  std::copy_n(m.coordinates.q.begin() + static_cast<std::ptrdiff_t>(s.index), 4, to);
}
void ball_rate(const Moment& m, const Sensor& s, double* to) {
  std::copy_n(m.coordinates.qd.begin() + static_cast<std::ptrdiff_t>(s.rate), 3, to);
}

// To the nearer limit, and the side on which it is; zeros within the limits.
std::pair<double, double> gap(double value, const Sensor& s) {
  const double low = value - s.lower, high = s.upper - value;
  if (std::min(low, high) >= 0) return {0.0, 0.0};
  return low < high ? std::pair{low, 1.0} : std::pair{high, -1.0};
}
void joint_gap(const Moment& m, const Sensor& s, double* to) { *to = gap(m.coordinates.q[s.index], s).first; }
void joint_gap_rate(const Moment& m, const Sensor& s, double* to) {
  *to = gap(m.coordinates.q[s.index], s).second * m.coordinates.qd[s.rate];
}
void tendon_gap(const Moment& m, const Sensor& s, double* to) {
  *to = gap(m.tendons[s.index].length, s).first;
}
void tendon_gap_rate(const Moment& m, const Sensor& s, double* to) {
  *to = gap(m.tendons[s.index].length, s).second * m.tendons[s.index].rate;
}

// Efforts: `index` is that of the dof, the actuator or the tendon.
void dof_motor(const Moment& m, const Sensor& s, double* to) {
  const Model& model = m.simulation.model();
  *to = m.simulation.state().dof_impulses[s.index].motor;
  for (Index a : model.actuators_of_dof(s.index)) {
    const auto k = static_cast<std::size_t>(a);
    *to += model.description().actuators[k].transmission.gear * m.simulation.state().actuator_impulses[k];
  }
  *to /= m.time;
}
void dof_limit(const Moment& m, const Sensor& s, double* to) {
  *to = std::abs(m.simulation.state().dof_impulses[s.index].limit / m.time);
}
void actuator_length(const Moment& m, const Sensor& s, double* to) { *to = m.actuators[s.index].length; }
void actuator_rate(const Moment& m, const Sensor& s, double* to) { *to = m.actuators[s.index].rate; }
void actuator_effort(const Moment& m, const Sensor& s, double* to) {
  *to = m.simulation.state().actuator_impulses[s.index] / m.time;
}
void tendon_length(const Moment& m, const Sensor& s, double* to) { *to = m.tendons[s.index].length; }
void tendon_rate(const Moment& m, const Sensor& s, double* to) { *to = m.tendons[s.index].rate; }
void tendon_limit(const Moment& m, const Sensor& s, double* to) {
  *to = std::abs(m.simulation.state().tendon_impulses[s.index].limit / m.time);
}
// Without gears, as in MuJoCo.
void on_tendon(const Moment& m, const Sensor& s, double* to) {
  const auto& actuators = m.simulation.model().description().actuators;
  *to = 0;
  for (std::size_t a = 0; a < actuators.size(); ++a)
    if (actuators[a].transmission.kind == Transmission::Kind::tendon &&
        static_cast<std::size_t>(actuators[a].transmission.tendon) == s.index)
      *to += m.simulation.state().actuator_impulses[a] / m.time;
}

// Of a frame, seen from that of its reference.
Vec3 place(const Moment& m, const Sensor& s) {
  const Moving there = seen_from(m, s);
  return there.local(at(m, s).pose.position - there.pose.position);
}
void frame_position(const Moment& m, const Sensor& s, double* to) { put(to, place(m, s)); }
void frame_orientation(const Moment& m, const Sensor& s, double* to) {
  const Quat q = conjugate(seen_from(m, s).pose.rotation) * at(m, s).pose.rotation;
  std::tie(to[0], to[1], to[2], to[3]) = std::make_tuple(q.w, q.x, q.y, q.z);
}
template <int Axis>
void frame_axis(const Moment& m, const Sensor& s, double* to) {
  put(to, seen_from(m, s).local(to_matrix(at(m, s).pose.rotation).column(Axis)));
}
void frame_velocity(const Moment& m, const Sensor& s, double* to) {
  const Moving frame = at(m, s), there = seen_from(m, s);
  const Vec3 carried = there.velocity + cross(there.spin, frame.pose.position - there.pose.position);
  put(to, there.local(frame.velocity - carried));
}
void frame_spin(const Moment& m, const Sensor& s, double* to) {
  const Moving there = seen_from(m, s);
  put(to, there.local(at(m, s).spin - there.spin));
}
void frame_acceleration(const Moment& m, const Sensor& s, double* to) { put(to, felt(m, at(m, s))); }
void frame_turning(const Moment& m, const Sensor& s, double* to) { put(to, at(m, s).turning); }

// From inside a volume a ray meets the surface where it leaves.
void inside(const Moment& m, const Sensor& s, double* to) {
  const RayHit hit = cast_ray(*s.volume, {place(m, s), {0, 0, 1}});
  *to = std::isfinite(hit.distance) && hit.normal.z >= 0 ? 1 : 0;
}

// Of the bodies that hang on a sensor.
struct Sum {
  double mass = 0;
  Vec3 centre, momentum, moment;
};
Sum sum_of(const Moment& m, const Sensor& s) {
  Sum sum;
  for (Index b : s.bodies) {
    const auto k = static_cast<std::size_t>(b);
    const double mass = m.simulation.model().description().bodies[k].mass;
    sum.mass += mass;
    sum.centre += mass * m.momenta[k].centre;
    sum.momentum += m.momenta[k].momentum.linear;
    sum.moment += m.momenta[k].momentum.angular;
  }
  sum.centre = sum.mass > 0 ? sum.centre / sum.mass : at(m, s).pose.position;
  return sum;
}
void centre(const Moment& m, const Sensor& s, double* to) { put(to, sum_of(m, s).centre); }
void mean_velocity(const Moment& m, const Sensor& s, double* to) {
  const Sum sum = sum_of(m, s);
  put(to, sum.momentum / (sum.mass > 0 ? sum.mass : 1.0));
}
void angular_momentum(const Moment& m, const Sensor& s, double* to) {
  const Sum sum = sum_of(m, s);
  put(to, sum.moment - cross(sum.centre, sum.momentum));
}
void clock(const Moment& m, const Sensor&, double* to) { *to = m.simulation.state().time; }

// What `index` counts.
enum class Of : unsigned char { nothing, q, dof, actuator, tendon };
struct SensorKind {
  const char* name;
  std::size_t size;
  Sensor::Read read;
  Of of = Of::nothing;
};
constexpr SensorKind sensor_kinds[] = {
    {"accelerometer", 3, &accelerometer},
    {"velocimeter", 3, &velocimeter},
    {"gyro", 3, &gyro},
    {"magnetometer", 3, &magnetometer},
    {"force", 3, &force},
    {"torque", 3, &torque},
    {"touch", 1, &touch},
    {"rangefinder", 1, &rangefinder},
    {"jointpos", 1, &position, Of::q},
    {"jointvel", 1, &rate, Of::q},
    {"jointactuatorfrc", 1, &dof_motor, Of::dof},
    {"ballquat", 4, &ball, Of::q},
    {"ballangvel", 3, &ball_rate, Of::q},
    {"jointlimitpos", 1, &joint_gap, Of::q},
    {"jointlimitvel", 1, &joint_gap_rate, Of::q},
    {"jointlimitfrc", 1, &dof_limit, Of::dof},
    {"actuatorpos", 1, &actuator_length, Of::actuator},
    {"actuatorvel", 1, &actuator_rate, Of::actuator},
    {"actuatorfrc", 1, &actuator_effort, Of::actuator},
    {"tendonpos", 1, &tendon_length, Of::tendon},
    {"tendonvel", 1, &tendon_rate, Of::tendon},
    {"tendonactuatorfrc", 1, &on_tendon, Of::tendon},
    {"tendonlimitpos", 1, &tendon_gap, Of::tendon},
    {"tendonlimitvel", 1, &tendon_gap_rate, Of::tendon},
    {"tendonlimitfrc", 1, &tendon_limit, Of::tendon},
    {"framepos", 3, &frame_position},
    {"framequat", 4, &frame_orientation},
    {"framexaxis", 3, &frame_axis<0>},
    {"frameyaxis", 3, &frame_axis<1>},
    {"framezaxis", 3, &frame_axis<2>},
    {"framelinvel", 3, &frame_velocity},
    {"frameangvel", 3, &frame_spin},
    {"framelinacc", 3, &frame_acceleration},
    {"frameangacc", 3, &frame_turning},
    {"insidesite", 1, &inside},
    {"subtreecom", 3, &centre},
    {"subtreelinvel", 3, &mean_velocity},
    {"subtreeangmom", 3, &angular_momentum},
    {"clock", 1, &clock},
};

const SensorKind& kind_named(const std::string& name) {
  for (const SensorKind& kind : sensor_kinds)
    if (name == kind.name) return kind;
  throw InputError("fmu.json: there is no kind of sensor \"" + name + "\"");
}

Transform transform_in(const Json& given) {
  const auto p = given.at(0).get<std::array<double, 3>>();
  const auto r = given.at(1).get<std::array<double, 4>>();
  return {{p[0], p[1], p[2]}, {r[0], r[1], r[2], r[3]}};
}

// Checks all indices: they are those of another file than the model's.
void require_parts(const Sensor& s, const SensorKind& kind, const Simulation& of) {
  const Model& model = of.model();
  const ModelDescription& d = model.description();
  const auto count = static_cast<Index>(model.bodies());
  const auto known = [&](Index b) { return b >= world && b < count; };
  std::size_t entries = std::size_t(-1);
  if (kind.of == Of::q) entries = of.tree().nq() - std::min(kind.size - 1, of.tree().nq());
  if (kind.of == Of::dof) entries = model.dofs();
  if (kind.of == Of::actuator) entries = d.actuators.size();
  if (kind.of == Of::tendon) entries = d.tendons.size();
  const bool rates = kind.of != Of::q || s.rate + (kind.size > 1 ? 3 : 1) <= of.tree().nv();
  AMONTONS_REQUIRE(known(s.body) && known(s.reference) && s.index < entries && rates &&
                       std::all_of(
                           s.bodies.begin(), s.bodies.end(), [&](Index b) { return b >= 0 && b < count; }) &&
                       (s.own.empty() || s.own.size() == d.geoms.size()),
                   "fmu.json: a sensor names a part that the model has not");
  AMONTONS_REQUIRE((kind.read != &touch && kind.read != &rangefinder) || s.own.size() == d.geoms.size(),
                   "fmu.json: a sensor does not say which geoms are its own");
  AMONTONS_REQUIRE(kind.read != &inside || s.volume, "fmu.json: a sensor has no volume");
}

}  // namespace

std::vector<Sensor> read_sensors(const Json& listed, const Json& volumes, const Simulation& simulation) {
  // Volumes are the shapes of a model of their own, which the reader of models checks.
  const auto geoms =
      volumes.is_null() ? std::vector<Geom>{} : read_model_json(volumes.dump(), "fmu.json: volumes").geoms;
  std::vector<Sensor> sensors;
  std::size_t first = 0;
  for (const Json& given : listed) {
    const SensorKind& kind = kind_named(given.at("kind").get<std::string>());
    Sensor s;
    s.read = kind.read;
    s.size = kind.size;
    s.first = first;
    first += kind.size;
    s.body = given.at("body").get<Index>();
    s.frame = transform_in(given.at("frame"));
    s.reference = given.at("reference").get<Index>();
    s.reference_frame = transform_in(given.at("reference_frame"));
    s.index = given.value("index", std::size_t(0));
    s.rate = given.value("rate", std::size_t(0));
    s.lower = given.value("lower", -infinity);
    s.upper = given.value("upper", infinity);
    s.bodies = given.value("bodies", std::vector<Index>{});
    s.own = given.value("own", std::vector<unsigned char>{});
    s.field = to_vec3(given.value("field", std::array<double, 3>{}));
    s.cutoff = given.value("cutoff", 0.0);
    if (const auto volume = given.find("volume"); volume != given.end()) {
      const auto k = volume->get<std::size_t>();
      AMONTONS_REQUIRE(k < geoms.size(), "fmu.json: a sensor names a volume that is not there");
      s.volume = geoms[k].shape;
    }
    require_parts(s, kind, simulation);
    sensors.push_back(std::move(s));
  }
  return sensors;
}

std::size_t values_of(const std::vector<Sensor>& sensors) {
  return sensors.empty() ? 0 : sensors.back().first + sensors.back().size;
}

void read_all(const Simulation& simulation, const std::vector<Sensor>& sensors, double* values) {
  if (sensors.empty()) return;
  const SensorMoment now(simulation);
  for (const Sensor& s : sensors) {
    s.read(now, s, values + s.first);
    if (s.cutoff > 0)
      for (std::size_t k = s.first; k < s.first + s.size; ++k)
        values[k] = std::clamp(values[k], -s.cutoff, s.cutoff);
  }
}

}  // namespace amontons::fmu
