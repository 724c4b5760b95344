#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

#include "bindings.hpp"

namespace amontons::python {

namespace {

// Keeps NumPy arrays alive for as long as an operator views them.
template <class... Arrays>
std::shared_ptr<const void> keep_alive(Arrays... arrays) {
  return std::make_shared<std::tuple<Arrays...>>(std::move(arrays)...);
}

OperatorHandle sparse(IndexVector indptr, IndexVector indices, Vector data) {
  return {SparseOperator{view(indptr), view(indices), view(data), keep_alive(indptr, indices, data)}};
}

OperatorHandle dense(Matrix a) {
  AMONTONS_REQUIRE(a.shape(0) == a.shape(1), "A: a dense matrix must be square");
  return {DenseOperator{{a.data(), a.size()}, a.shape(0), keep_alive(a)}};
}

// y = A x by a Python callable. The callable gets an array of its own, so that it may keep it.
struct PythonProduct {
  nb::callable function;

  void operator()(std::span<const double> x, std::span<double> y) const {
    nb::gil_scoped_acquire gil;
    nb::object result = call(x);
    Vector values;
    if (!nb::try_cast(result, values) || values.shape(0) != y.size())
      throw InputError("A: the product must return " + std::to_string(y.size()) + " numbers for " +
                       std::to_string(x.size()) + " rows");
    for (std::size_t i = 0; i < y.size(); ++i) {
      y[i] = values.data()[i];
      AMONTONS_REQUIRE(std::isfinite(y[i]),
                       "A: entry " + std::to_string(i) + " of a product A x is not finite");
    }
  }

 private:
  nb::object call(std::span<const double> x) const {
    const nb::object argument = nb::cast(to_numpy(std::vector<double>(x.begin(), x.end())));
    try {
      return function(argument);
    } catch (nb::python_error& error) {
      if (!solve_scope.running || solve_scope.interrupted || !error.matches(PyExc_KeyboardInterrupt)) throw;
      solve_scope.interrupted = true;
    }
    return function(argument);  // once more, so that the solver can end with a valid iterate
  }
};

OperatorHandle callback(nb::callable function, Vector diagonal) {
  return {
      CallbackOperator{PythonProduct{std::move(function)}, {view(diagonal).begin(), view(diagonal).end()}}};
}

std::array<double, 6> six(const Matrix& a, std::size_t i) {
  std::array<double, 6> row;
  std::copy_n(a.data() + 6 * i, 6, row.begin());
  return row;
}

std::array<double, 3> three(const Matrix& a, std::size_t i) { return {a(i, 0), a(i, 1), a(i, 2)}; }

InverseMass inverse_mass_of(const Vector& translation, const Matrix& inertia) {
  InverseMass mass;
  mass.translation.assign(translation.data(), translation.data() + translation.shape(0));
  for (std::size_t i = 0; i < inertia.shape(0); ++i) mass.inertia.push_back(six(inertia, i));
  return mass;
}

BodyOperator bodies_of(const Vector& inverse_mass, const Matrix& inverse_inertia, const IndexVector& body_a,
                       const IndexVector& body_b, const Matrix& jacobian_a, const Matrix& jacobian_b,
                       const Vector& compliance) {
  const std::size_t m = body_a.shape(0);
  AMONTONS_REQUIRE(body_b.shape(0) == m && jacobian_a.shape(0) == m && jacobian_b.shape(0) == m &&
                       compliance.shape(0) == m && jacobian_a.shape(1) == 6 && jacobian_b.shape(1) == 6 &&
                       inverse_inertia.shape(1) == 6 && inverse_inertia.shape(0) == inverse_mass.shape(0),
                   "rows: the arrays differ in length");
  BodyOperator op;
  op.inverse_mass = inverse_mass_of(inverse_mass, inverse_inertia);
  op.jacobian.reserve(m);
  for (std::size_t i = 0; i < m; ++i)
    op.jacobian.push_back({body_a(i), body_b(i), six(jacobian_a, i), six(jacobian_b, i)});
  op.compliance.assign(compliance.data(), compliance.data() + m);
  return op;
}

OperatorHandle contacts(Vector inverse_mass, Matrix inverse_inertia, IndexVector body_a, IndexVector body_b,
                        Matrix r_a, Matrix r_b, Matrix normal, Vector compliance, IndexVector joint_body_a,
                        IndexVector joint_body_b, Matrix joint_jacobian_a, Matrix joint_jacobian_b,
                        Vector joint_compliance) {
  const std::size_t n = body_a.shape(0);
  AMONTONS_REQUIRE(body_b.shape(0) == n && r_a.shape(0) == n && r_b.shape(0) == n && normal.shape(0) == n &&
                       compliance.shape(0) == n && r_a.shape(1) == 3 && r_b.shape(1) == 3 &&
                       normal.shape(1) == 3,
                   "contacts: the arrays differ in length");
  ContactOperator op;
  op.contacts.reserve(n);
  for (std::size_t c = 0; c < n; ++c)
    op.contacts.push_back({body_a(c), body_b(c), three(r_a, c), three(r_b, c), three(normal, c)});
  op.contact_compliance.assign(compliance.data(), compliance.data() + n);
  op.joints = bodies_of(inverse_mass, inverse_inertia, joint_body_a, joint_body_b, joint_jacobian_a,
                        joint_jacobian_b, joint_compliance);
  return {std::move(op)};
}

// The stored rows of a contact operator: (body_a, body_b, jacobian_a, jacobian_b, compliance), the matrices
// flattened.
nb::tuple stored(const OperatorHandle& handle) {
  const auto* op = std::get_if<ContactOperator>(&handle.get());
  AMONTONS_REQUIRE(op != nullptr, "stored: this operator has no contacts");
  const BodyOperator rows = op->stored();
  std::vector<double> body_a, body_b, a, b;
  for (const JacobianRow& row : rows.jacobian) {
    body_a.push_back(row.body_a), body_b.push_back(row.body_b);
    a.insert(a.end(), row.a.begin(), row.a.end());
    b.insert(b.end(), row.b.begin(), row.b.end());
  }
  return nb::make_tuple(to_numpy(std::move(body_a)), to_numpy(std::move(body_b)), to_numpy(std::move(a)),
                        to_numpy(std::move(b)), to_numpy(rows.compliance));
}

}  // namespace

void bind_operators(nb::module_& m) {
  nb::class_<OperatorHandle>(m, "Operator", "A symmetric positive semidefinite map, one of five kinds.")
      .def_prop_ro("rows", [](const OperatorHandle& h) { return rows(h.get()); })
      .def(
          "product",
          [](const OperatorHandle& h, Vector x) {
            const std::size_t n = rows(h.get());
            AMONTONS_REQUIRE(x.shape(0) == n, "A x: x has " + std::to_string(x.shape(0)) +
                                                  " entries but A has " + std::to_string(n) + " rows");
            std::vector<double> y(n);
            {
              nb::gil_scoped_release release;
              product(h.get(), view(x), y);
            }
            return to_numpy(std::move(y));
          },
          nb::arg("x"), "A x.")
      .def("diagonal",
           [](const OperatorHandle& h) {
             std::vector<double> d(rows(h.get()));
             diagonal(h.get(), d);
             return to_numpy(std::move(d));
           })
      .def("stored", &stored);
  m.def("sparse_operator", &sparse, nb::arg("indptr"), nb::arg("indices"), nb::arg("data"));
  m.def("dense_operator", &dense, nb::arg("a"));
  m.def("callback_operator", &callback, nb::arg("function"), nb::arg("diagonal"));
  m.def(
      "body_operator",
      [](Vector mass, Matrix inertia, IndexVector body_a, IndexVector body_b, Matrix a, Matrix b, Vector e) {
        return OperatorHandle{bodies_of(mass, inertia, body_a, body_b, a, b, e)};
      },
      nb::arg("inverse_mass"), nb::arg("inverse_inertia"), nb::arg("body_a"), nb::arg("body_b"),
      nb::arg("jacobian_a"), nb::arg("jacobian_b"), nb::arg("compliance"));
  m.def("contact_operator", &contacts, nb::arg("inverse_mass"), nb::arg("inverse_inertia"), nb::arg("body_a"),
        nb::arg("body_b"), nb::arg("r_a"), nb::arg("r_b"), nb::arg("normal"), nb::arg("compliance"),
        nb::arg("joint_body_a"), nb::arg("joint_body_b"), nb::arg("joint_jacobian_a"),
        nb::arg("joint_jacobian_b"), nb::arg("joint_compliance"));
  m.def(
      "contact_tangents",
      [](Matrix normals) {
        std::vector<double> t;
        for (std::size_t i = 0; i < normals.shape(0); ++i) {
          std::array<double, 3> t1, t2;
          contact_tangents(three(normals, i), t1, t2);
          t.insert(t.end(), t1.begin(), t1.end());
          t.insert(t.end(), t2.begin(), t2.end());
        }
        return to_numpy(std::move(t));
      },
      nb::arg("normals"), "Both tangents of every normal, six numbers each.");
}

}  // namespace amontons::python
