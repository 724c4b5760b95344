#include <string>
#include <variant>

#include "amontons/base/isa.hpp"
#include "amontons/base/policy.hpp"
#include "bindings.hpp"

namespace {

const char* instruction_set() {
  switch (amontons::active_isa()) {
    case amontons::Isa::avx512:
      return "avx512";
    case amontons::Isa::avx2:
      return "avx2";
    case amontons::Isa::baseline:
      break;
  }
  return "baseline";
}

const char* compiler() {
#if defined(__clang__)
  return __VERSION__;  // begins with the name
#else
  return "GCC " __VERSION__;
#endif
}

nanobind::dict policy() {
  nanobind::dict numbers;
  for (const amontons::RoomPolicy& room : amontons::policy())
    for (const amontons::PolicyNumber& number : room.numbers) {
      const std::string name = std::string(room.room).append(".").append(number.name);
      std::visit([&](const auto* value) { numbers[name.c_str()] = *value; }, number.value);
    }
  return numbers;
}

}  // namespace

NB_MODULE(_core, m) {
  using namespace amontons::python;
  m.doc() = "The C++ core of amontons. Use the package `amontons`, which checks and documents its arguments.";
  // Shapes that a user's module still holds at the end of the interpreter are not leaks.
  nanobind::set_leak_warnings(false);
  nanobind::exception<amontons::InputError>(m, "InputError", PyExc_ValueError);
  m.def("instruction_set", instruction_set,
        "The kernels that this processor runs: baseline, avx2 or avx512.");
  m.def("compiler", compiler, "Name and version of the compiler that made this module.");
  m.def("policy", policy, "The tuned numbers of the core by name; counts are integers.");
  m.def("set_policy", amontons::set_policy, nanobind::arg("name"), nanobind::arg("value"),
        "Sets a tuned number of this process, while nothing is solved. benchmarks/sensitivity.py alone calls "
        "it.");
  bind_cones(m);
  bind_operators(m);
  bind_problem(m);
  bind_iterate(m);
  bind_options(m);
  bind_solution(m);
  bind_solve(m);
  bind_shapes(m);
  bind_model(m);
  bind_state(m);
  bind_simulation(m);
  bind_tables(m);
  bind_kinematics(m);
  bind_worlds(m);
  bind_held_step(m);
  bind_picture(m);
}
