#include <nanobind/stl/vector.h>

#include "amontons/sets/product.hpp"
#include "bindings.hpp"

namespace amontons::python {

namespace {

void add(SetProduct& K, const std::string& name, std::size_t count, const std::vector<Vector>& columns) {
  const std::size_t kind = kind_of_name(name);
  AMONTONS_REQUIRE(kind < set_kinds, "there is no set \"" + name + "\"");
  visit_kind(kind, [&]<class S>() {
    AMONTONS_REQUIRE(columns.size() == parameter_count<S>,
                     name + " has " + std::to_string(parameter_count<S>) + " parameters, not " +
                         std::to_string(columns.size()));
    std::vector<std::span<const double>> views;
    for (const Vector& column : columns) views.push_back(view(column));
    if constexpr (parameter_count<S> == 0)
      K.add_count<S>(count);
    else
      K.add_columns<S>(views);
  });
}

}  // namespace

void bind_cones(nb::module_& m) {
  nb::class_<SetProduct>(m, "SetProduct", "A product of small sets, in the order in which they are added.")
      .def(nb::init<>())
      .def("add", &add, nb::arg("name"), nb::arg("count"), nb::arg("parameters"),
           "Blocks of the set of that name, with one array of `count` entries per parameter.")
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
