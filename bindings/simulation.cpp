#include "amontons/multibody/step/simulation.hpp"

#include <type_traits>

#include "amontons/base/interrupt.hpp"
#include "amontons/collision/broad_phase.hpp"
#include "amontons/solvers/first_order/forwarded_iterate.hpp"
#include "bindings.hpp"
#include "math_casters.hpp"

namespace amontons::python {

namespace {

const char* path_name(StepPath path) {
  switch (path) {
    case StepPath::accurate:
      return "accurate";
    case StepPath::joints_restored:
      return "joints_restored";
    case StepPath::budget_spent:
      return "budget_spent";
    case StepPath::impulses_scaled:
      return "impulses_scaled";
    case StepPath::bodies_stopped:
      return "bodies_stopped";
  }
  return "";
}

using Handle = std::shared_ptr<Simulation>;

// Handles Ctrl-C and other signals, whose handlers Python runs on the main thread: an exception of a handler
// ends the step, which then restores its state.
template <class Work>
auto patiently(Work&& work) {
  decltype(work()) result;
  {
    nb::gil_scoped_release release;
    const Interrupt interrupt([] {
      nb::gil_scoped_acquire gil;
      return PyErr_CheckSignals() != 0;
    });
    result = work();
  }
  if (PyErr_Occurred()) throw nb::python_error();
  return result;
}

Report step(Simulation& s) {
  return patiently([&] { return s.step(); });
}

Simulation::Run run_steps(Simulation& s, std::size_t steps, double seconds) {
  return patiently([&] { return s.run(steps, seconds); });
}

// A writable array over a vector of the state: the simulation never changes its length, so the memory stays.
template <auto Field>
void def_view(nb::class_<Simulation>& cls, const char* name) {
  cls.def_prop_ro(
      name,
      [](const Handle& s) {
        auto& values = s->state().*Field;
        using Entry = typename std::remove_reference_t<decltype(values)>::value_type;
        return matrix_view(reinterpret_cast<double*>(values.data()), values.size(),
                           sizeof(Entry) / sizeof(double), s);
      },
      nb::rv_policy::automatic);
}

template <auto Field>
void def_vector_view(nb::class_<Simulation>& cls, const char* name) {
  cls.def_prop_ro(
      name, [](const Handle& s) { return view_of(s->state().*Field, s); }, nb::rv_policy::automatic);
}

// Copies into the vectors of the state, which arrays of the package view.
void restore(Simulation& simulation, const State& saved) {
  State& state = idle(simulation).state();
  const auto copy = [](auto& to, const auto& from) {
    AMONTONS_REQUIRE(to.size() == from.size(), "restore: the state is that of another model");
    std::copy(from.begin(), from.end(), to.begin());
  };
  copy(state.positions, saved.positions);
  copy(state.orientations, saved.orientations);
  copy(state.linear_velocities, saved.linear_velocities);
  copy(state.angular_velocities, saved.angular_velocities);
  copy(state.middle_velocities, saved.middle_velocities);
  copy(state.forces, saved.forces);
  copy(state.torques, saved.torques);
  copy(state.coordinates, saved.coordinates);
  copy(state.joint_forces, saved.joint_forces);
  copy(state.joint_wrenches, saved.joint_wrenches);
  copy(state.joint_slips, saved.joint_slips);
  copy(state.dof_impulses, saved.dof_impulses);
  copy(state.ball_impulses, saved.ball_impulses);
  copy(state.coupling_impulses, saved.coupling_impulses);
  copy(state.tendon_impulses, saved.tendon_impulses);
  copy(state.dof_slips, saved.dof_slips);
  copy(state.rub_impulses, saved.rub_impulses);
  copy(state.bond_openings, saved.bond_openings);
  copy(state.controls, saved.controls);
  copy(state.held_forces, saved.held_forces);
  copy(state.held_torques, saved.held_torques);
  copy(state.held_controls, saved.held_controls);
  copy(state.held_joint_forces, saved.held_joint_forces);
  copy(state.activations, saved.activations);
  copy(state.actuator_impulses, saved.actuator_impulses);
  state.contacts = saved.contacts;
  state.time = saved.time;
  state.steps = saved.steps;
  state.impulse_step = saved.impulse_step;
  state.last_step = saved.last_step;
}

// Pairs of geoms that began to carry a force in the last step, and pairs that ceased to: body_a, body_b,
// geom_a, geom_b of each, (n, 4).
nb::tuple contact_events(const Simulation& s) {
  const auto rows = [](const std::vector<GeomPair>& pairs) {
    std::vector<Index> out;
    for (const GeomPair& p : pairs) out.insert(out.end(), {p.body_a, p.body_b, p.geom_a, p.geom_b});
    return to_numpy(std::move(out), 4);
  };
  const ContactEvents events = idle(s).contact_events();
  return nb::make_tuple(rows(events.began), rows(events.ended));
}

// Arms of the contacts of the last step from both centres of mass, (n, 3) each.
nb::tuple contact_arms(const Simulation& s) {
  std::vector<double> a, b;
  for (const Contact& c : idle(s).contacts()) {
    a.insert(a.end(), {c.r_a.x, c.r_a.y, c.r_a.z});
    b.insert(b.end(), {c.r_b.x, c.r_b.y, c.r_b.z});
  }
  return nb::make_tuple(to_numpy(std::move(a), 3), to_numpy(std::move(b), 3));
}

// A Python object that any thread may release.
struct Held {
  nb::object object;
  explicit Held(nb::object o) : object(std::move(o)) {}
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;
  ~Held() {
    if (!nb::is_alive()) {
      object.release();
      return;
    }
    nb::gil_scoped_acquire gil;
    object.reset();
  }
};

// function(problem, x0 or None, options) -> x, called with copies: Python may keep its arguments.
StepMethod own_method(nb::object function) {
  if (function.is_none()) return {};
  return
      [held = std::make_shared<Held>(std::move(function))](const Problem& problem, const Options& options) {
        nb::gil_scoped_acquire gil;
        nb::object x0 = nb::none();
        if (!options.x0.empty())
          x0 = nb::cast(to_numpy(std::vector<double>(options.x0.begin(), options.x0.end())));
        const auto x = nb::cast<Vector>(
            held->object(std::make_shared<Problem>(problem), x0, std::make_shared<Options>(options)));
        return std::vector<double>(view(x).begin(), view(x).end());
      };
}

// Whether the step is sound, and no joint stays apart by more than a thousandth of Model.length.
bool is_usual(const Report& r, double length) {
  const double error = std::max(r.joint_error, length * r.joint_angle_error);
  return r.advanced && r.is_sound() && (r.joints_close || r.worst_joint < 0 || error <= length / 1000);
}

void bind_options_and_report(nb::module_& m) {
  using O = SimulationOptions;
  nb::class_<O>(m, "SimulationOptions", "Fields of zero that may be automatic follow from the model.")
      .def(nb::init<>())
      .def_rw("dt", &O::dt)
      .def_rw("law", &O::law)
      .def_rw("method", &O::method)
      .def(
          "set_own_method", [](O& o, nb::object function) { o.own_method = own_method(std::move(function)); },
          nb::arg("function"), "function(problem, x0 or None, options) -> x in the place of a method.")
      .def_rw("tolerance", &O::tolerance)
      .def_rw("max_iterations", &O::max_iterations)
      .def_rw("budget", &O::budget)
      .def_rw("threads", &O::threads)
      .def_rw("iterates", &O::iterates, nb::arg().none())
      .def_rw("pairs", &O::pairs, nb::arg().none())
      .def_rw("margin", &O::margin)
      .def_prop_rw(
          "recovery", [](const O& o) { return o.recovery == Recovery::velocity ? "velocity" : "projection"; },
          [](O& o, const std::string& name) {
            o.recovery = name == "velocity" ? Recovery::velocity : Recovery::projection;
          })
      .def_rw("recovery_speed", &O::recovery_speed)
      .def_rw("restitution_speed", &O::restitution_speed)
      .def_rw("warm_start", &O::warm_start)
      .def_rw("max_substeps", &O::max_substeps);
  nb::class_<Timings>(m, "Timings")
      .def_ro("collision", &Timings::collision)
      .def_ro("assembly", &Timings::assembly)
      .def_ro("solve", &Timings::solve)
      .def_ro("integration", &Timings::integration)
      .def_ro("total", &Timings::total);
  nb::class_<Report>(m, "Report")
      .def_ro("time", &Report::time)
      .def_ro("advanced", &Report::advanced)
      .def_prop_ro("status", [](const Report& r) { return name_of(r.status); })
      .def_prop_ro("is_sound", &Report::is_sound)
      .def("is_usual", &is_usual, nb::arg("length"),
           "Whether the step is sound and no joint stays apart by more than length / 1000: nothing to warn "
           "of.")
      .def_ro("residual", &Report::residual)
      .def_prop_ro("path", [](const Report& r) { return path_name(r.path); })
      .def_ro("solves", &Report::solves)
      .def_ro("iterations", &Report::iterations)
      .def_ro("products", &Report::products)
      .def_ro("factorizations", &Report::factorizations)
      .def_ro("contacts", &Report::contacts)
      .def_ro("joint_rows", &Report::joint_rows)
      .def_ro("substeps", &Report::substeps)
      .def_ro("penetration", &Report::penetration)
      .def_ro("joint_error", &Report::joint_error)
      .def_ro("joint_angle_error", &Report::joint_angle_error)
      .def_ro("worst_joint", &Report::worst_joint)
      .def_ro("joints_close", &Report::joints_close)
      .def_ro("kinetic_energy", &Report::kinetic_energy)
      .def_ro("potential_energy", &Report::potential_energy)
      .def_ro("spring_energy", &Report::spring_energy)
      .def_ro("energy_balance", &Report::energy_balance)
      .def_ro("balanced", &Report::balanced)
      .def_ro("timings", &Report::timings)
      .def_ro("method", &Report::method);
  using R = Simulation::Run;
  nb::class_<R>(m, "Run", "Steps that were made one after the other.")
      .def_ro("report", &R::report)
      .def_ro("steps", &R::steps)
      .def_ro("residual", &R::residual);
}

void bind_views(nb::class_<Simulation>& cls) {
  def_view<&State::positions>(cls, "positions");
  def_view<&State::orientations>(cls, "orientations");
  def_view<&State::linear_velocities>(cls, "linear_velocities");
  def_view<&State::angular_velocities>(cls, "angular_velocities");
  def_view<&State::forces>(cls, "forces");
  def_view<&State::torques>(cls, "torques");
  def_vector_view<&State::coordinates>(cls, "joint_coordinates");
  def_vector_view<&State::joint_forces>(cls, "joint_forces");
  def_view<&State::joint_wrenches>(cls, "joint_wrenches");
  def_view<&State::dof_impulses>(cls, "dof_impulses");
  def_view<&State::ball_impulses>(cls, "ball_impulses");
  def_vector_view<&State::coupling_impulses>(cls, "coupling_impulses");
  def_view<&State::tendon_impulses>(cls, "tendon_impulses");
  def_vector_view<&State::rub_impulses>(cls, "rub_impulses");
  def_vector_view<&State::bond_openings>(cls, "bond_openings");
  def_vector_view<&State::controls>(cls, "controls");
  def_vector_view<&State::held_controls>(cls, "held_controls");
  def_vector_view<&State::held_joint_forces>(cls, "held_joint_forces");
  def_vector_view<&State::activations>(cls, "activations");
  def_vector_view<&State::actuator_impulses>(cls, "actuator_impulses");
}

}  // namespace

void bind_simulation(nb::module_& m) {
  bind_options_and_report(m);
  nb::class_<Simulation> cls(m, "Simulation", "A model and its state; the arrays view the state's memory.");
  cls.def(nb::new_([](std::shared_ptr<Model> model, const SimulationOptions& options) {
            return std::make_shared<Simulation>(std::move(model), options);
          }),
          nb::arg("model"), nb::arg("options"))
      .def("copy", [](const Simulation& s) { return std::make_shared<Simulation>(idle(s)); })
      .def(
          "assign", [](Simulation& s, const Simulation& other) { idle(s) = idle(other); }, nb::arg("other"))
      .def("reset", [](Simulation& s) { idle(s).reset(); })
      .def(
          "set_joint_coordinates",
          [](Simulation& s, const Vector& values) {
            std::vector<double>& to = s.state().coordinates;
            AMONTONS_REQUIRE(values.shape(0) == to.size(), "joint_coordinates has another length");
            std::copy_n(values.data(), to.size(), to.data());
          },
          nb::arg("values"))
      .def(
          "set_time", [](Simulation& s, double time) { s.state().time = time; }, nb::arg("time"))
      .def("step", &step)
      .def("run", &run_steps, nb::arg("steps"), nb::arg("seconds"),
           "At most so many steps; ends after one that is not sound, and after so many seconds.")
      .def("snapshot", [](const Simulation& s) { return idle(s).state(); })
      .def("restore", &restore, nb::arg("state"))
      .def(
          "restore_last", [](Simulation& s) { restore(s, s.last_state()); },
          "The state before the last step.")
      .def(
          "show_middle", [](Simulation& s) { s.show_middle(); },
          "Replaces velocities by those with which the next step begins.")
      .def(
          "begin_with_shown", [](Simulation& s, bool steady) { s.begin_with_shown(steady); },
          nb::arg("steady"),
          "Begins the next step with the velocities in the state; steady: as after a step with these loads.")
      .def_prop_ro("time", [](const Simulation& s) { return s.state().time; })
      .def_prop_ro("steps", [](const Simulation& s) { return s.state().steps; })
      .def_prop_ro("impulse_step", [](const Simulation& s) { return s.state().impulse_step; })
      .def_prop_ro("margin", &Simulation::margin)
      .def_prop_ro("recovery_speed", &Simulation::recovery_speed)
      .def_prop_ro("restitution_speed", &Simulation::restitution_speed)
      .def_prop_ro(
          "impulses", [](const Simulation& s) { return to_numpy(idle(s).impulses()); },
          nb::rv_policy::automatic)
      .def("contact_arms", &contact_arms)
      .def("contact_events", &contact_events)
      .def_prop_ro(
          "problem",
          [](const Simulation& s) -> std::shared_ptr<const Problem> {
            const auto problem = idle(s).problem();
            return problem && has_trees(*problem) ? std::make_shared<const Problem>(as_matrix(*problem))
                                                  : problem;
          },
          nb::for_getter(nb::sig("def problem(self) -> Problem | None")),
          "The VI of the last step, shared and never changed; None before the first.")
      .def(
          "instant",
          [](const Simulation& s) {
            StepInstant at = idle(s).instant();
            return std::make_pair(at.time, to_numpy(std::move(at.q)));
          },
          "Time and generalised coordinates to which the forces of the last step belong.")
      .def_prop_ro("instant_time", [](const Simulation& s) { return idle(s).instant_time(); })
      .def("momentum", [](const Simulation& s) {
        const Momentum p = momentum(s.model(), s.state());
        return std::make_pair(p.linear, p.angular);
      });
  bind_views(cls);
}

}  // namespace amontons::python
