#include "bindings.hpp"

NB_MODULE(_core, m) {
  using namespace amontons::python;
  m.doc() = "The C++ core of amontons. Use the package `amontons`, which checks and documents its arguments.";
  // Shapes that a module of the user still holds when the interpreter ends are no leaks.
  nanobind::set_leak_warnings(false);
  nanobind::exception<amontons::InputError>(m, "InputError", PyExc_ValueError);
  bind_cones(m);
  bind_operators(m);
  bind_problem(m);
  bind_options(m);
  bind_solution(m);
  bind_solve(m);
  bind_shapes(m);
  bind_model(m);
  bind_state(m);
  bind_simulation(m);
  bind_kinematics(m);
  bind_worlds(m);
}
