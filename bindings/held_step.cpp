#include "amontons/multibody/derivatives/held_step.hpp"

#include "bindings.hpp"

namespace amontons::python {

// Python makes the simulations: options are those of `given`, with the method that holds the faces.
void bind_held_step(nb::module_& m) {
  nb::class_<HeldStep>(m, "HeldStep", "The last step of a simulation with its faces held.")
      .def(nb::init<const Simulation&>(), nb::arg("simulation"))
      .def("options", &HeldStep::options, nb::arg("given"), nb::arg("reach"),
           "Options of simulations that make the step on these faces.")
      .def("close", &HeldStep::close, "Ends the search for faces, which a step has found.")
      .def_prop_ro("margin", &HeldStep::margin)
      .def_prop_ro("determines_velocities", &HeldStep::determines_velocities)
      .def_prop_ro("others", &HeldStep::others)
      .def_prop_ro("residual", &HeldStep::residual);
}

}  // namespace amontons::python
