#include "amontons/sets/product.hpp"
#include "bindings.hpp"

namespace amontons::python {

void bind_cones(nb::module_& m) {
  nb::class_<SetProduct>(m, "SetProduct", "A product of small sets, in the order in which they are added.")
      .def(nb::init<>())
      .def("add_free", &SetProduct::add_free, nb::arg("count"))
      .def("add_nonnegative", &SetProduct::add_nonnegative, nb::arg("count"))
      .def(
          "add_interval", [](SetProduct& K, Vector lo, Vector hi) { K.add_interval(view(lo), view(hi)); },
          nb::arg("lo"), nb::arg("hi"))
      .def(
          "add_friction", [](SetProduct& K, Vector mu) { K.add_friction(view(mu)); }, nb::arg("mu"))
      .def_prop_ro("rows", &SetProduct::rows)
      .def_prop_ro("blocks", &SetProduct::blocks)
      .def_prop_ro("contacts", &SetProduct::contacts)
      .def(
          "project",
          [](const SetProduct& K, Vector x) {
            AMONTONS_REQUIRE(x.shape(0) == K.rows(), "project: x has " + std::to_string(x.shape(0)) +
                                                         " entries but the cones have " +
                                                         std::to_string(K.rows()) + " rows");
            std::vector<double> out(K.rows());
            project(K, view(x), out);
            return to_numpy(std::move(out));
          },
          nb::arg("x"), "Euclidean projection on the product.")
      .def(
          "distance",
          [](const SetProduct& K, Vector x) {
            AMONTONS_REQUIRE(x.shape(0) == K.rows(), "distance: x has " + std::to_string(x.shape(0)) +
                                                         " entries but the cones have " +
                                                         std::to_string(K.rows()) + " rows");
            return distance(K, view(x));
          },
          nb::arg("x"), "Euclidean distance to the product.");
}

}  // namespace amontons::python
