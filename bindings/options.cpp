#include "amontons/solvers/driver/options.hpp"

#include "amontons/solvers/first_order/forwarded_iterate.hpp"
#include "bindings.hpp"

namespace amontons::python {

namespace {

// A field of one of the method groups of Options as an attribute of the flat Python object.
template <auto Group, auto Field>
void def_field(nb::class_<Options>& cls, const char* name) {
  using Value = std::remove_cvref_t<decltype((std::declval<Options&>().*Group).*Field)>;
  cls.def_prop_rw(
      name, [](const Options& o) { return (o.*Group).*Field; },
      [](Options& o, Value value) { (o.*Group).*Field = value; });
}

}  // namespace

void bind_options(nb::module_& m) {
  nb::class_<Options> cls(m, "Options", "Options of a solve; x0 and callback are arguments of solve().");
  cls.def(nb::init<>())
      .def_rw("law", &Options::law)
      .def_rw("tolerance", &Options::tolerance)
      .def_rw("max_iterations", &Options::max_iterations)
      .def_rw("deadline", &Options::deadline)
      .def_rw("history", &Options::history)
      .def_rw("threads", &Options::threads)
      .def_rw("iterates", &Options::iterates, nb::arg().none());
  def_field<&Options::spg, &SpgOptions::alpha_min>(cls, "alpha_min");
  def_field<&Options::spg, &SpgOptions::alpha_max>(cls, "alpha_max");
  def_field<&Options::spg, &SpgOptions::sigma_min>(cls, "sigma_min");
  def_field<&Options::spg, &SpgOptions::sigma_max>(cls, "sigma_max");
  def_field<&Options::spg, &SpgOptions::memory>(cls, "memory");
  def_field<&Options::spg, &SpgOptions::gamma>(cls, "gamma");
  def_field<&Options::spg, &SpgOptions::tau_g>(cls, "tau_g");
  def_field<&Options::sor, &SorOptions::omega>(cls, "sor_omega");
  def_field<&Options::jacobi, &JacobiOptions::omega>(cls, "jacobi_omega");
}

}  // namespace amontons::python
