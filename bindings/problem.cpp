#include "amontons/problem/problem.hpp"

#include "amontons/base/math.hpp"
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

// The sets in row order, (name, rows) or (name, parameters ...): what amontons.problem.cones makes cones of.
nb::list sets_of(const Problem& problem) {
  const SetProduct& K = problem.K;
  nb::list sets;
  const auto part = [](const std::vector<double>& all, const SetRun& run) {
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(run.param);
    return to_numpy(std::vector<double>(first, first + static_cast<std::ptrdiff_t>(run.count)));
  };
  for (const SetRun& run : K.runs()) switch (run.kind) {
      case SetKind::free:
        sets.append(nb::make_tuple("free", run.count));
        break;
      case SetKind::nonnegative:
        sets.append(nb::make_tuple("nonnegative", run.count));
        break;
      case SetKind::interval:
        sets.append(nb::make_tuple("interval", part(K.lo(), run), part(K.hi(), run)));
        break;
      case SetKind::friction:
        sets.append(nb::make_tuple("friction", part(K.mu(), run)));
        break;
    }
  return sets;
}

// Bodies and rows by the names of the arguments of amontons.Factored, those of the rows after `prefix`.
nb::dict arrays_of(const BodyOperator& op, const std::string& prefix) {
  std::vector<Index> body_a, body_b;
  std::vector<double> jacobian_a, jacobian_b, inertia;
  for (const JacobianRow& row : op.jacobian) {
    body_a.push_back(row.body_a);
    body_b.push_back(row.body_b);
    jacobian_a.insert(jacobian_a.end(), row.a.begin(), row.a.end());
    jacobian_b.insert(jacobian_b.end(), row.b.begin(), row.b.end());
  }
  for (const auto& six : op.inverse_mass.inertia) inertia.insert(inertia.end(), six.begin(), six.end());
  nb::dict d;
  d["inverse_mass"] = to_numpy(op.inverse_mass.translation);
  d["inverse_inertia"] = to_numpy(std::move(inertia), 6);
  d[(prefix + "body_a").c_str()] = to_numpy(std::move(body_a));
  d[(prefix + "body_b").c_str()] = to_numpy(std::move(body_b));
  d[(prefix + "jacobian_a").c_str()] = to_numpy(std::move(jacobian_a), 6);
  d[(prefix + "jacobian_b").c_str()] = to_numpy(std::move(jacobian_b), 6);
  d[(prefix + "compliance").c_str()] = to_numpy(op.compliance);
  return d;
}

// The same of contacts, by the names of the arguments of amontons.Contacts.
nb::dict arrays_of(const ContactOperator& op) {
  std::vector<Index> body_a, body_b;
  std::vector<double> r_a, r_b, normal;
  for (const ContactFrame& c : op.contacts) {
    body_a.push_back(c.body_a);
    body_b.push_back(c.body_b);
    r_a.insert(r_a.end(), c.r_a.begin(), c.r_a.end());
    r_b.insert(r_b.end(), c.r_b.begin(), c.r_b.end());
    normal.insert(normal.end(), c.normal.begin(), c.normal.end());
  }
  nb::dict d = arrays_of(op.joints, "joint_");
  d["body_a"] = to_numpy(std::move(body_a));
  d["body_b"] = to_numpy(std::move(body_b));
  d["r_a"] = to_numpy(std::move(r_a), 3);
  d["r_b"] = to_numpy(std::move(r_b), 3);
  d["normal"] = to_numpy(std::move(normal), 3);
  d["compliance"] = to_numpy(op.contact_compliance);
  return d;
}

// Of the operators that C++ makes; a matrix or function came from the package, which has it still.
nb::dict operator_arrays(const Problem& problem) {
  if (const auto* contacts = std::get_if<ContactOperator>(&problem.A)) return arrays_of(*contacts);
  const auto* rows = std::get_if<BodyOperator>(&problem.A);
  AMONTONS_REQUIRE(rows != nullptr, "this operator has no bodies; keep the matrix of which it was made");
  return arrays_of(*rows, "");
}

}  // namespace

void bind_problem(nb::module_& m) {
  nb::enum_<Law>(m, "Law").value("associated", Law::associated).value("coulomb", Law::coulomb);
  nb::enum_<Norm>(m, "Norm")
      .value("natural", Norm::natural)
      .value("plain", Norm::plain)
      .value("plain_inf", Norm::plain_inf)
      .value("siconos", Norm::siconos);
  m.attr("ASYMMETRY") = asymmetry_of_rounding;
  nb::class_<Problem>(m, "Problem", "A x + b over a product of sets; checked when it is made.")
      .def(nb::new_(&make), nb::arg("A"), nb::arg("b"), nb::arg("cones"), "Takes over the operator A.")
      .def_prop_ro("rows", &Problem::rows)
      .def_prop_ro(
          "b", [](const std::shared_ptr<Problem>& p) { return view_of(p->b, p); }, nb::rv_policy::automatic,
          "A view; not to be written.")
      .def("sets", &sets_of, "The sets in row order: (name, rows) or (name, parameters ...).")
      .def("operator_arrays", &operator_arrays, "Arguments of amontons.Contacts or amontons.Factored.")
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
