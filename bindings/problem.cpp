#include "amontons/problem/problem.hpp"

#include "amontons/problem/residual.hpp"
#include "bindings.hpp"

namespace amontons::python {

namespace {

void require_rows(const Problem& problem, const Vector& x, const char* name) {
  AMONTONS_REQUIRE(x.shape(0) == problem.rows(), std::string(name) + " has " + std::to_string(x.shape(0)) +
                                                     " entries but the problem has " +
                                                     std::to_string(problem.rows()) + " rows");
}

std::shared_ptr<Problem> make(OperatorHandle& A, Vector b, const SetProduct& K) {
  AMONTONS_REQUIRE(!A.taken, "this operator was handed over to a problem; build another one");
  std::vector<double> rhs(view(b).begin(), view(b).end());
  A.taken = true;
  return std::make_shared<Problem>(make_problem(std::move(A.op), std::move(rhs), K));
}

}  // namespace

void bind_problem(nb::module_& m) {
  nb::enum_<Law>(m, "Law").value("associated", Law::associated).value("coulomb", Law::coulomb);
  nb::enum_<Norm>(m, "Norm")
      .value("natural", Norm::natural)
      .value("plain", Norm::plain)
      .value("plain_inf", Norm::plain_inf)
      .value("siconos", Norm::siconos);
  nb::class_<Problem>(m, "Problem", "A x + b over a product of sets; checked when it is made.")
      .def(nb::new_(&make), nb::arg("A"), nb::arg("b"), nb::arg("cones"), "Takes over the operator A.")
      .def_prop_ro("rows", &Problem::rows)
      .def_prop_ro(
          "preconditioner", [](const Problem& p) { return to_numpy(p.P); }, nb::rv_policy::automatic,
          "Mean of diag(A) per cone block.")
      .def(
          "product",
          [](const Problem& p, Vector x) {
            require_rows(p, x, "x");
            std::vector<double> y(p.rows());
            {
              nb::gil_scoped_release release;
              product(p.A, view(x), y);
            }
            return to_numpy(std::move(y));
          },
          nb::arg("x"), "A x.")
      .def(
          "residual",
          [](const Problem& p, Vector x, Law law, Norm norm) {
            require_rows(p, x, "x");
            nb::gil_scoped_release release;
            return residual(p, law, view(x), norm);
          },
          nb::arg("x"), nb::arg("law"), nb::arg("norm"))
      .def(
          "violations",
          [](const Problem& p, Vector x, Law law) {
            require_rows(p, x, "x");
            Violations v;
            {
              nb::gil_scoped_release release;
              v = violations(p, law, view(x));
            }
            return nb::make_tuple(v.penetration_velocity, v.cone, v.complementarity, v.energy);
          },
          nb::arg("x"), nb::arg("law"), "(penetration velocity, cone, complementarity, energy).");
}

}  // namespace amontons::python
