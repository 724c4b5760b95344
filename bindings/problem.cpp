#include "amontons/problem/problem.hpp"

#include <algorithm>

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

std::shared_ptr<Problem> make(OperatorHandle& A, Vector b, const SetProduct& K, Law law) {
  AMONTONS_REQUIRE(!A.taken, "this operator was handed over to a problem; build another one");
  std::vector<double> rhs(view(b).begin(), view(b).end());
  A.taken = true;
  return std::make_shared<Problem>(make_problem(std::move(A.op), std::move(rhs), K, law));
}

// The sets in row order, (name, count, parameters ...) with one array per parameter, from which
// amontons.problem.cones makes cones.
nb::list sets_of(const Problem& problem) {
  nb::list sets;
  for (const SetRun& run : problem.K.runs())
    visit_kind(run.kind, [&]<class S>() {
      std::vector<std::vector<double>> columns(parameter_count<S>, std::vector<double>(run.count));
      for (std::size_t i = 0; i < run.count; ++i) {
        const auto values = parameters(problem.K.all<S>()[run.first + i]);
        for (std::size_t k = 0; k < values.size(); ++k) columns[k][i] = values[k];
      }
      nb::list entry;
      entry.append(S::name);
      entry.append(run.count);
      for (std::vector<double>& column : columns) entry.append(to_numpy(std::move(column)));
      sets.append(nb::tuple(entry));
    });
  return sets;
}

// Bodies and stored rows, by the argument names of amontons.vi.Factored; names of the rows follow `prefix`.
nb::dict arrays_of(const ContactSystem& op, const std::string& prefix) {
  std::vector<Index> body_a, body_b;
  std::vector<double> jacobian_a, jacobian_b, inertia;
  for (const JacobianRow& row : op.jacobian) {
    body_a.push_back(row.body_a);
    body_b.push_back(row.body_b);
    jacobian_a.insert(jacobian_a.end(), row.a.begin(), row.a.end());
    jacobian_b.insert(jacobian_b.end(), row.b.begin(), row.b.end());
  }
  for (const auto& six : op.bodies.inverse_inertia) inertia.insert(inertia.end(), six.begin(), six.end());
  nb::dict d;
  d["inverse_mass"] = to_numpy(op.bodies.inverse_mass);
  d["inverse_inertia"] = to_numpy(std::move(inertia), 6);
  d[(prefix + "body_a").c_str()] = to_numpy(std::move(body_a));
  d[(prefix + "body_b").c_str()] = to_numpy(std::move(body_b));
  d[(prefix + "jacobian_a").c_str()] = to_numpy(std::move(jacobian_a), 6);
  d[(prefix + "jacobian_b").c_str()] = to_numpy(std::move(jacobian_b), 6);
  d[(prefix + "compliance").c_str()] = to_numpy(op.compliance);
  return d;
}

// The same with contacts, by the argument names of amontons.vi.Contacts.
nb::dict arrays_with_contacts(const ContactSystem& op) {
  std::vector<Index> body_a, body_b, rows;
  std::vector<double> r_a, r_b, normal, direction, length;
  const auto add = [](std::vector<double>& to, const Vec3& v) { to.insert(to.end(), {v.x, v.y, v.z}); };
  for (const ContactGeometry& c : op.contacts) {
    body_a.push_back(c.body_a);
    body_b.push_back(c.body_b);
    rows.push_back(c.rows);
    length.push_back(c.moment_length);
    add(r_a, c.r_a);
    add(r_b, c.r_b);
    add(normal, c.normal);
    add(direction, c.direction);
  }
  nb::dict d = arrays_of(op, "joint_");
  d["body_a"] = to_numpy(std::move(body_a));
  d["body_b"] = to_numpy(std::move(body_b));
  d["r_a"] = to_numpy(std::move(r_a), 3);
  d["r_b"] = to_numpy(std::move(r_b), 3);
  d["normal"] = to_numpy(std::move(normal), 3);
  d["direction"] = to_numpy(std::move(direction), 3);
  d["rows"] = to_numpy(std::move(rows));
  d["moment_length"] = to_numpy(std::move(length));
  d["compliance"] = to_numpy(op.contact_compliance);
  return d;
}

// Arrays of an operator that C++ made: with bodies, or the matrix of a step with trees. A function comes from
// the package, which still has it.
nb::dict operator_arrays(const Problem& problem) {
  if (const auto* dense = std::get_if<DenseOperator>(&problem.A)) {
    nb::dict d;
    d["matrix"] = to_numpy(std::vector<double>(dense->data.begin(), dense->data.end()), dense->m);
    return d;
  }
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  AMONTONS_REQUIRE(system != nullptr, "this operator has no bodies; keep the matrix of which it was made");
  return system->contacts.empty() ? arrays_of(*system, "") : arrays_with_contacts(*system);
}

bool has_moments(const Problem& problem) {
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  return system != nullptr && std::any_of(system->contacts.begin(), system->contacts.end(),
                                          [](const ContactGeometry& c) { return c.rows > 3; });
}

// The arguments from which a solver is made.
void bind_parts(nb::class_<Problem>& cls) {
  cls.def(
         "project",
         [](const Problem& p, Vector x) {
           require_rows(p, x, "x");
           std::vector<double> y(p.rows());
           project(p.K, view(x), y);
           return to_numpy(std::move(y));
         },
         nb::arg("x"), "Pi_K(x), Euclidean.")
      .def(
          "de_saxce",
          [](const Problem& p, Vector u, Law law) {
            require_rows(p, u, "u");
            std::vector<double> term(p.rows(), 0.0);
            for_each_block(p.K, [&]<class S>(const S& set, std::size_t, std::size_t row) {
              if constexpr (S::frictional)
                if (law == Law::coulomb) term[row] = set.de_saxce(&view(u)[row]);
            });
            return to_numpy(std::move(term));
          },
          nb::arg("u"), nb::arg("law"), "The De Saxce term.")
      .def(
          "natural_map",
          [](const Problem& p, Vector x, Law law) {
            require_rows(p, x, "x");
            std::vector<double> r(p.rows());
            {
              nb::gil_scoped_release release;
              natural_map_step(p, law, view(x), r);
            }
            return to_numpy(std::move(r));
          },
          nb::arg("x"), nb::arg("law"), "x - Pi_K(x - g / P).");
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
  nb::class_<Problem> cls(m, "Problem", "A x + b over a product of sets; checked when it is made.");
  bind_parts(cls);
  cls.def(nb::new_(&make), nb::arg("A"), nb::arg("b"), nb::arg("cones"), nb::arg("law"),
          "Takes over the operator A.")
      .def_ro("law", &Problem::law)
      .def_prop_ro("rows", &Problem::rows)
      .def_prop_ro(
          "b", [](const std::shared_ptr<Problem>& p) { return view_of(p->b, p); }, nb::rv_policy::automatic,
          "A view; not to be written.")
      .def_prop_ro("has_moments", &has_moments, "Whether a contact has moments, over its length.")
      .def("sets", &sets_of, "The sets in row order: (name, count, parameters ...).")
      .def("operator_arrays", &operator_arrays,
           "Arguments of amontons.vi.Contacts or amontons.vi.Factored, or the matrix of a step with trees.")
      .def_prop_ro(
          "preconditioner",
          [](const Problem& p) {
            std::vector<double> P(p.rows());
            for_each_block(p.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
              std::fill_n(&P[row], S::dim, p.P[block]);
            });
            return to_numpy(std::move(P));
          },
          nb::rv_policy::automatic, "Mean of diag(A) of the cone block of each row.")
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
