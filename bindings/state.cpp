#include <algorithm>
#include <cmath>
#include <cstddef>

#include "amontons/multibody/joints/coordinates.hpp"
#include "amontons/multibody/kinematics/tree.hpp"
#include "bindings.hpp"

namespace amontons::python {

namespace {

// Entries of a State are plain structs of doubles, or start with two indices: files store them as rows of
// numbers.
static_assert(sizeof(Vec3) == 24 && sizeof(Quat) == 32 && sizeof(JointWrench) == 48 &&
                  sizeof(DofImpulse) == 32 && sizeof(TendonImpulse) == 32 && sizeof(MiddleVelocity) == 96,
              "the arrays of a state take these structs as rows of doubles");
template <class T>
OutMatrix rows_of(const std::vector<T>& values) {
  const auto* first = reinterpret_cast<const double*>(values.data());
  constexpr std::size_t width = sizeof(T) / sizeof(double);
  return to_numpy(std::vector<double>(first, first + width * values.size()), width);
}

template <class T>
void set_rows(std::vector<T>& values, const Matrix& rows, const char* name) {
  constexpr std::size_t width = sizeof(T) / sizeof(double);
  AMONTONS_REQUIRE(rows.shape(0) == values.size() && rows.shape(1) == width,
                   std::string(name) + " has shape (" + std::to_string(rows.shape(0)) + ", " +
                       std::to_string(rows.shape(1)) + "); the model asks for (" +
                       std::to_string(values.size()) + ", " + std::to_string(width) + ")");
  std::copy_n(rows.data(), width * values.size(), reinterpret_cast<double*>(values.data()));
}

void set_entries(std::vector<double>& values, const Vector& given, const char* name) {
  AMONTONS_REQUIRE(given.shape(0) == values.size(),
                   std::string(name) + " has " + std::to_string(given.shape(0)) +
                       " entries; the model asks for " + std::to_string(values.size()));
  std::copy_n(given.data(), values.size(), values.data());
}

// The data of the last contacts that a step reads: geoms, the point on A, impulse and angular impulse, slip.
OutMatrix contact_rows(const State& state) {
  std::vector<double> out;
  for (const CarriedContact& c : state.contacts) {
    out.insert(out.end(), {static_cast<double>(c.geom_a), static_cast<double>(c.geom_b)});
    for (const Vec3& v : {c.local, c.impulse, c.angular_impulse}) out.insert(out.end(), {v.x, v.y, v.z});
    out.push_back(c.slip);
  }
  return to_numpy(std::move(out), 12);
}

void set_contacts(State& state, const Model& model, const Matrix& rows) {
  AMONTONS_REQUIRE(rows.shape(1) == 12 || rows.shape(1) == 11 || rows.shape(1) == 8,
                   "contacts must have twelve columns (eleven before there was slip, eight before moments)");
  const auto geoms = static_cast<double>(model.description().geoms.size());
  std::vector<CarriedContact> contacts(rows.shape(0));
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    for (int k = 0; k < 2; ++k)
      AMONTONS_REQUIRE(rows(i, k) >= 0 && rows(i, k) < geoms && rows(i, k) == std::floor(rows(i, k)),
                       "contacts[" + std::to_string(i) + "] names a geom that the model does not have");
    CarriedContact& c = contacts[i];
    c.geom_a = static_cast<Index>(rows(i, 0));
    c.geom_b = static_cast<Index>(rows(i, 1));
    c.local = {rows(i, 2), rows(i, 3), rows(i, 4)};
    c.impulse = {rows(i, 5), rows(i, 6), rows(i, 7)};
    if (rows.shape(1) > 8) c.angular_impulse = {rows(i, 8), rows(i, 9), rows(i, 10)};
    if (rows.shape(1) > 11 && rows(i, 11) > 0) c.slip = rows(i, 11);
  }
  state.contacts = std::move(contacts);
}

nb::dict arrays_of_state(const State& s) {
  nb::dict d;
  d["time"] = s.time;
  d["steps"] = s.steps;
  d["impulse_step"] = s.impulse_step;
  d["last_step"] = s.last_step;
  d["positions"] = rows_of(s.positions);
  d["orientations"] = rows_of(s.orientations);
  d["linear_velocities"] = rows_of(s.linear_velocities);
  d["angular_velocities"] = rows_of(s.angular_velocities);
  d["middle_velocities"] = rows_of(s.middle_velocities);
  d["forces"] = rows_of(s.forces);
  d["torques"] = rows_of(s.torques);
  d["joint_coordinates"] = to_numpy(s.coordinates);
  d["joint_forces"] = to_numpy(s.joint_forces);
  d["contacts"] = contact_rows(s);
  d["joint_wrenches"] = rows_of(s.joint_wrenches);
  d["joint_slips"] = rows_of(s.joint_slips);
  d["dof_impulses"] = rows_of(s.dof_impulses);
  d["ball_impulses"] = rows_of(s.ball_impulses);
  d["coupling_impulses"] = to_numpy(s.coupling_impulses);
  d["tendon_impulses"] = rows_of(s.tendon_impulses);
  d["controls"] = to_numpy(s.controls);
  d["held_forces"] = rows_of(s.held_forces);
  d["held_torques"] = rows_of(s.held_torques);
  d["held_controls"] = to_numpy(s.held_controls);
  d["held_joint_forces"] = to_numpy(s.held_joint_forces);
  d["dof_slips"] = to_numpy(s.dof_slips);
  d["rub_impulses"] = to_numpy(s.rub_impulses);
  d["bond_openings"] = to_numpy(s.bond_openings);
  d["activations"] = to_numpy(s.activations);
  d["actuator_impulses"] = to_numpy(s.actuator_impulses);
  return d;
}

Matrix matrix_of(const nb::dict& d, const char* name) {
  Matrix a;
  AMONTONS_REQUIRE(d.contains(name) && nb::try_cast(d[name], a),
                   std::string(name) + " is missing or no matrix of numbers");
  return a;
}

Vector vector_of(const nb::dict& d, const char* name) {
  Vector a;
  AMONTONS_REQUIRE(d.contains(name) && nb::try_cast(d[name], a),
                   std::string(name) + " is missing or no vector of numbers");
  return a;
}

// The next step continues these. They are missing in files from before velocities were those of the instant
// of poses: the next step then begins with the velocities.
void set_middle(State& s, const nb::dict& d) {
  s.held_joint_forces.resize(s.joint_forces.size());
  if (!(s.last_step > 0)) return;
  set_rows(s.middle_velocities, matrix_of(d, "middle_velocities"), "middle_velocities");
  set_rows(s.held_forces, matrix_of(d, "held_forces"), "held_forces");
  set_rows(s.held_torques, matrix_of(d, "held_torques"), "held_torques");
  if (!s.held_controls.empty()) set_entries(s.held_controls, vector_of(d, "held_controls"), "held_controls");
  set_entries(s.held_joint_forces, vector_of(d, "held_joint_forces"), "held_joint_forces");
}

State state_of(const std::shared_ptr<Model>& shared, double time, std::uint64_t steps, double impulse_step,
               const nb::dict& d, double last_step) {
  const Model& model = *shared;
  State s = initial_state(model);
  s.time = time;
  s.steps = steps;
  s.impulse_step = impulse_step;
  s.last_step = last_step;
  set_rows(s.positions, matrix_of(d, "positions"), "positions");
  set_rows(s.orientations, matrix_of(d, "orientations"), "orientations");
  set_rows(s.linear_velocities, matrix_of(d, "linear_velocities"), "linear_velocities");
  set_rows(s.angular_velocities, matrix_of(d, "angular_velocities"), "angular_velocities");
  set_rows(s.forces, matrix_of(d, "forces"), "forces");
  set_rows(s.torques, matrix_of(d, "torques"), "torques");
  set_entries(s.coordinates, vector_of(d, "joint_coordinates"), "joint_coordinates");
  s.joint_forces.resize(Tree(shared).nv());
  set_entries(s.joint_forces, vector_of(d, "joint_forces"), "joint_forces");
  set_contacts(s, model, matrix_of(d, "contacts"));
  set_rows(s.joint_wrenches, matrix_of(d, "joint_wrenches"), "joint_wrenches");
  // Missing in a state saved by version 0.1.0; a missing slip costs accuracy in one step.
  if (d.contains("joint_slips")) set_rows(s.joint_slips, matrix_of(d, "joint_slips"), "joint_slips");
  set_rows(s.dof_impulses, matrix_of(d, "dof_impulses"), "dof_impulses");
  set_rows(s.ball_impulses, matrix_of(d, "ball_impulses"), "ball_impulses");
  set_entries(s.coupling_impulses, vector_of(d, "coupling_impulses"), "coupling_impulses");
  // Missing in files from before tendons and actuators were part of the core.
  if (!s.tendon_impulses.empty())
    set_rows(s.tendon_impulses, matrix_of(d, "tendon_impulses"), "tendon_impulses");
  if (!s.controls.empty()) set_entries(s.controls, vector_of(d, "controls"), "controls");
  if (!s.activations.empty()) {
    set_entries(s.activations, vector_of(d, "activations"), "activations");
    set_entries(s.actuator_impulses, vector_of(d, "actuator_impulses"), "actuator_impulses");
  }
  set_middle(s, d);
  // Missing in files from before dry friction had a static value, and ropes friction on pulleys.
  if (!s.dof_slips.empty() && d.contains("dof_slips"))
    set_entries(s.dof_slips, vector_of(d, "dof_slips"), "dof_slips");
  if (!s.rub_impulses.empty() && d.contains("rub_impulses"))
    set_entries(s.rub_impulses, vector_of(d, "rub_impulses"), "rub_impulses");
  if (!s.bond_openings.empty()) set_entries(s.bond_openings, vector_of(d, "bond_openings"), "bond_openings");
  validate(model, s);
  return s;
}

}  // namespace

void bind_state(nb::module_& m) {
  m.attr("FARTHEST") = largest_coordinate;
  nb::class_<State>(m, "State", "A copy of all that a simulation changes.")
      .def(nb::new_(&state_of), nb::arg("model"), nb::arg("time"), nb::arg("steps"), nb::arg("impulse_step"),
           nb::arg("arrays"), nb::arg("last_step") = 0.0)
      .def_ro("time", &State::time)
      .def_ro("steps", &State::steps)
      .def_prop_ro("arrays", &arrays_of_state, nb::rv_policy::automatic, "Every array by name, as copies.");
}

}  // namespace amontons::python
