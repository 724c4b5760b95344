#include "amontons/solvers/solvers.hpp"
#include "bindings.hpp"

namespace amontons::python {

namespace {

// Ctrl-C during a solve: Python notes the signal, and PyErr_CheckSignals runs its handler. The
// KeyboardInterrupt that this raises becomes the status `interrupted` with the best iterate. Any other
// exception (from a user's handler) propagates through the solver, which unwinds cleanly.
bool signalled() {
  if (solve_scope.interrupted) return true;
  nb::gil_scoped_acquire gil;
  if (PyErr_CheckSignals() == 0) return false;
  if (!PyErr_ExceptionMatches(PyExc_KeyboardInterrupt)) throw nb::python_error();
  PyErr_Clear();
  return true;
}

bool call_back(const nb::object& callback, const IterationRecord& record) {
  nb::gil_scoped_acquire gil;
  try {
    return nb::cast<bool>(nb::bool_(callback(record)));
  } catch (nb::python_error& error) {
    if (!error.matches(PyExc_KeyboardInterrupt)) throw;
    return true;
  }
}

// A callback may itself solve another problem: afterwards the outer scope is restored.
struct ScopeGuard {
  SolveScope outer = solve_scope;
  ScopeGuard() { solve_scope = {true, false}; }
  ~ScopeGuard() { solve_scope = outer; }
};

std::shared_ptr<Solution> run(const Problem& problem, const std::string& method, const Options& given,
                              std::optional<Vector> x0, nb::object callback) {
  Options options = given;
  if (x0) {
    options.x0 = view(*x0);
    // The core takes an empty x0 as no start; here x0 was given.
    AMONTONS_REQUIRE(x0->shape(0) == problem.rows(), "x0 has " + std::to_string(x0->shape(0)) +
                                                         " entries but the problem has " +
                                                         std::to_string(problem.rows()) + " rows");
  }
  if (!callback.is_none())
    options.callback = [&callback](const IterationRecord& record) { return call_back(callback, record); };
  options.interrupted = signalled;
  const ScopeGuard guard;
  nb::gil_scoped_release release;
  return std::make_shared<Solution>(solve(problem, method, options));
}

}  // namespace

void bind_solve(nb::module_& m) {
  m.def("solve", &run, nb::arg("problem"), nb::arg("method"), nb::arg("options"),
        nb::arg("x0").none() = nb::none(), nb::arg("callback").none() = nb::none());
  m.def("method_names", [] {
    std::vector<std::string> names;
    for (std::string_view name : method_names()) names.emplace_back(name);
    return names;
  });
}

}  // namespace amontons::python
