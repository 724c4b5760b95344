#include <cstring>
#include <limits>
#include <type_traits>

#include "amontons/multibody/joints/actuators.hpp"
#include "amontons/multibody/kinematics/dynamics.hpp"
#include "amontons/multibody/step/simulation.hpp"
#include "bindings.hpp"
#include "math_casters.hpp"

// The tables of a simulation, one call each: the bytes of structured arrays, whose fields follow each other
// without gaps. Their dtypes are in python/amontons/simulation (forces.py, links.py), with the fields in the
// same order.
namespace amontons::python {

namespace {

using OutBytes = nb::ndarray<nb::numpy, unsigned char, nb::ndim<1>>;

class TableBytes {
 public:
  template <class... T>
  void add(const T&... fields) {
    (append(fields), ...);
  }
  OutBytes take() { return to_numpy(std::move(bytes_)); }

 private:
  template <class T>
  void append(const T& field) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % 4 == 0);
    const std::size_t size = bytes_.size();
    bytes_.resize(size + sizeof(T));
    std::memcpy(bytes_.data() + size, &field, sizeof(T));
  }

  std::vector<unsigned char> bytes_;
};

// The time (s) over which impulses of the last step acted. Before the first step all impulses are zero.
double acting_time(const Simulation& s) { return s.state().impulse_step > 0 ? s.state().impulse_step : 1.0; }

// Text of at most five characters as NumPy has it: four bytes each, zeros behind it.
struct Text {
  char32_t characters[5] = {};
  explicit Text(const char* text) {
    for (int i = 0; i < 5 && text[i]; ++i) characters[i] = static_cast<char32_t>(text[i]);
  }
};

const char* name_of(ContactState state) {
  return state == ContactState::open ? "open" : state == ContactState::stick ? "stick" : "slip";
}

// CONTACTS. `links`: the link of each geom.
OutBytes table_of_contacts(const Simulation& simulation, const IndexVector& links) {
  const Simulation& s = idle(simulation);
  AMONTONS_REQUIRE(links.shape(0) == s.model().description().geoms.size(), "links needs one entry per geom");
  const double time = acting_time(s);
  TableBytes rows;
  for (const Contact& c : s.contacts())
    rows.add(c.body_a, c.body_b, c.geom_a, c.geom_b, links(c.geom_a), links(c.geom_b), c.point, c.normal,
             c.gap, c.material.friction, c.impulse, c.impulse / time, c.angular_impulse / time, c.slip,
             c.spin, c.normal_velocity, Text(name_of(c.state)));
  return rows.take();
}

// REACTIONS; zeros before the first step.
OutBytes table_of_reactions(const Simulation& simulation) {
  const Simulation& s = idle(simulation);
  const double time = acting_time(s);
  const auto& joints = s.model().description().joints;
  TableBytes rows;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const JointReaction r = j < s.joint_reactions().size() ? s.joint_reactions()[j] : JointReaction{};
    rows.add(static_cast<Index>(j), joints[j].body_a, joints[j].body_b, r.point, r.impulse / time,
             r.angular / time);
  }
  return rows.take();
}

// EFFORTS. The impulse of an actuator is along its length; its effort on the degree of freedom is that times
// the gear.
OutBytes table_of_efforts(const Simulation& simulation) {
  const Simulation& s = idle(simulation);
  const State& state = s.state();
  const ModelDescription& d = s.model().description();
  const double time = acting_time(s);
  TableBytes rows;
  std::size_t dof = 0;
  for (std::size_t j = 0; j < d.joints.size(); ++j)
    for (std::size_t k = 0; k < d.joints[j].dofs.size(); ++k, ++dof) {
      const DofImpulse& impulse = state.dof_impulses[dof];
      double motor = impulse.motor;
      for (Index a : s.model().actuators_of_dof(dof))
        motor += d.actuators[a].transmission.gear * state.actuator_impulses[a];
      const Index control = s.model().control_of_dof(dof);
      rows.add(static_cast<Index>(j), static_cast<Index>(k), state.coordinates[dof],
               control < 0 ? std::numeric_limits<double>::quiet_NaN() : state.controls[control],
               impulse.passive / time, motor / time, impulse.friction / time, impulse.limit / time);
    }
  return rows.take();
}

// TENDONS. The spring of a tendon is passive.
OutBytes table_of_tendons(const Simulation& simulation) {
  const Simulation& s = idle(simulation);
  const double time = acting_time(s);
  TableBytes rows;
  Index tendon = 0;
  for (const LineState& line : tendon_lines(s.model(), s.state())) {
    const TendonImpulse& t = s.state().tendon_impulses[tendon];
    rows.add(tendon++, line.length, line.rate, t.passive / time + t.spring / time, t.friction / time,
             t.limit / time);
  }
  return rows.take();
}

// ACTUATORS
OutBytes table_of_actuators(const Simulation& simulation) {
  const Simulation& s = idle(simulation);
  const State& state = s.state();
  TableBytes rows;
  Index a = 0;
  for (const LineState& line : actuator_lines(s.model(), s.state())) {
    rows.add(a, state.controls[a], state.activations[a], line.length, line.rate,
             state.actuator_impulses[a] / acting_time(s));
    ++a;
  }
  return rows.take();
}

// MOVING, of frames on bodies (-1: the world), given as position and quaternion. Velocities are those of qd,
// so that they are the Jacobian times qd.
OutBytes table_of_moving(const Simulation& simulation, const IndexVector& bodies, const Matrix& frames) {
  const Simulation& s = idle(simulation);
  AMONTONS_REQUIRE(frames.shape(0) == bodies.shape(0) && frames.shape(1) == 7,
                   "frames must have seven columns and a row for each body");
  const State& state = s.state();
  const Coordinates c = read_coordinates(s.tree(), state);
  const TreeMotion motion =
      motion_of(s.tree(), state, pose_of(s.tree(), state, c.q), c.qd, std::vector<double>(s.tree().nv()));
  TableBytes rows;
  for (std::size_t i = 0; i < bodies.shape(0); ++i) {
    const Index body = bodies(i);
    AMONTONS_REQUIRE(body >= world && body < static_cast<Index>(s.model().bodies()), "there is no such body");
    Transform at{{frames(i, 0), frames(i, 1), frames(i, 2)},
                 {frames(i, 3), frames(i, 4), frames(i, 5), frames(i, 6)}};
    Vec3 velocity, spin;
    if (body >= 0) {
      at = Transform{state.positions[body], state.orientations[body]} * at;
      velocity = velocity_at(motion.velocities[body], at.position);
      spin = motion.velocities[body].angular;
    }
    rows.add(body, at.position, at.rotation, velocity, spin);
  }
  return rows.take();
}

}  // namespace

void bind_tables(nb::module_& m) {
  m.def("contact_rows", &table_of_contacts, nb::arg("simulation"), nb::arg("links"));
  m.def("reaction_rows", &table_of_reactions, nb::arg("simulation"));
  m.def("effort_rows", &table_of_efforts, nb::arg("simulation"));
  m.def("tendon_rows", &table_of_tendons, nb::arg("simulation"));
  m.def("actuator_rows", &table_of_actuators, nb::arg("simulation"));
  m.def("moving_rows", &table_of_moving, nb::arg("simulation"), nb::arg("bodies"), nb::arg("frames"));
}

}  // namespace amontons::python
