#include "amontons/multibody/worlds/worlds.hpp"

#include <algorithm>

#include "bindings.hpp"

namespace amontons::python {

namespace {

using Rows = nb::ndarray<const double, nb::ndim<3>, nb::c_contig, nb::device::cpu>;

// (worlds, records, columns) array of a course.
nb::ndarray<nb::numpy, double, nb::ndim<3>> cube(std::vector<double> values, std::size_t worlds,
                                                 std::size_t records, std::size_t columns) {
  auto* owner = new std::vector<double>(std::move(values));
  nb::capsule capsule(owner, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
  return nb::ndarray<nb::numpy, double, nb::ndim<3>>(owner->data(), {worlds, records, columns}, capsule);
}

// Whether Python has a signal to handle; without its lock.
bool interrupted() {
  nb::gil_scoped_acquire acquire;
  return PyErr_CheckSignals() != 0;
}

nb::tuple run(const std::vector<const Tree*>& trees, const std::vector<std::shared_ptr<Simulation>>& worlds,
              const std::optional<Rows>& controls, const std::optional<Rows>& joint_forces,
              std::size_t records, std::size_t repeat, unsigned threads) {
  Schedule schedule{.records = records, .repeat = repeat, .threads = threads};
  if (controls) {
    AMONTONS_REQUIRE(controls->shape(0) == worlds.size() && controls->shape(1) == records,
                     "controls must have one row per world and record");
    schedule.controls = {controls->data(), controls->size()};
  }
  if (joint_forces) {
    AMONTONS_REQUIRE(joint_forces->shape(0) == worlds.size() && joint_forces->shape(1) == records,
                     "joint_forces must have one row per world and record");
    schedule.joint_forces = {joint_forces->data(), joint_forces->size()};
  }
  AMONTONS_REQUIRE(!trees.empty(), "run_worlds needs a tree");
  const Tree& tree = *trees.front();
  Course course;
  {
    nb::gil_scoped_release release;
    course = run_worlds(trees, worlds, schedule, interrupted);
  }
  if (PyErr_Occurred()) throw nb::python_error();
  const std::size_t n = worlds.size();
  return nb::make_tuple(
      cube(std::move(course.q), n, records, tree.nq()), cube(std::move(course.qd), n, records, tree.nv()),
      to_numpy(std::move(course.residuals), records), to_numpy(std::move(course.missed), records),
      std::move(course.done), std::move(course.failures));
}

// The names that the package has for entries of a state, in the order of Change::Entry.
Change::Entry entry_of(std::string_view name) {
  constexpr std::string_view names[] = {
      "nothing", "q", "qd", "activations", "controls", "joint_forces", "held_controls", "held_joint_forces"};
  const auto* found = std::find(std::begin(names), std::end(names), name);
  AMONTONS_REQUIRE(found != std::end(names), "there is nothing of this name to change");
  return static_cast<Change::Entry>(found - std::begin(names));
}

// Entries are those of the package, which knows their numbers.
nb::tuple changed_steps(const Simulation& before,
                        const std::vector<std::tuple<std::string, std::size_t, double>>& given,
                        const Vector& q, bool steady, unsigned threads) {
  std::vector<Change> changes;
  for (const auto& [name, index, by] : given) changes.push_back({entry_of(name), index, by});
  ChangedSteps steps;
  {
    nb::gil_scoped_release release;
    steps = make_changed_steps(before, changes, view(q), steady, threads, interrupted);
  }
  if (PyErr_Occurred()) throw nb::python_error();
  const std::size_t width = changes.empty() ? 0 : steps.rows.size() / changes.size();
  return nb::make_tuple(to_numpy(std::move(steps.rows), width), steps.residual, std::move(steps.failure));
}

}  // namespace

void bind_worlds(nb::module_& m) {
  m.def("changed_steps", &changed_steps, nb::arg("before"), nb::arg("changes"), nb::arg("q"),
        nb::arg("steady"), nb::arg("threads"),
        "States after a step, for each change (of what, entry, by) of the state before it: their rows, the "
        "largest residual and why a step failed.");
  m.def("run_worlds", &run, nb::arg("trees"), nb::arg("worlds"), nb::arg("controls").none(),
        nb::arg("joint_forces").none(), nb::arg("records"), nb::arg("repeat"), nb::arg("threads"),
        "Advances simulations side by side, without the GIL: q, qd, residuals and missed steps by world and "
        "record, how many "
        "records each world completed, and why it stopped.");
}

}  // namespace amontons::python
