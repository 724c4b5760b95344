#include <algorithm>
#include <cmath>
#include <cstring>
#include <tuple>

#include "bindings.hpp"

namespace amontons::python {

namespace {

// Keeps NumPy arrays alive while an operator views them.
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

// y = A x by a Python callable. The callable gets its own array, which it may keep.
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
    return function(argument);  // again, so that the solver can end with a valid iterate
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

Vec3 vec3(const Matrix& a, std::size_t i) { return {a(i, 0), a(i, 1), a(i, 2)}; }

// A system of rows without contacts.
ContactSystem rows_of(const Vector& inverse_mass, const Matrix& inverse_inertia, const IndexVector& body_a,
                      const IndexVector& body_b, const Matrix& jacobian_a, const Matrix& jacobian_b,
                      const Vector& compliance) {
  const std::size_t m = body_a.shape(0);
  AMONTONS_REQUIRE(body_b.shape(0) == m && jacobian_a.shape(0) == m && jacobian_b.shape(0) == m &&
                       compliance.shape(0) == m && jacobian_a.shape(1) == 6 && jacobian_b.shape(1) == 6 &&
                       inverse_inertia.shape(1) == 6 && inverse_inertia.shape(0) == inverse_mass.shape(0),
                   "rows: the arrays differ in length");
  ContactSystem op;
  op.bodies.inverse_mass.assign(view(inverse_mass).begin(), view(inverse_mass).end());
  for (std::size_t i = 0; i < inverse_inertia.shape(0); ++i)
    op.bodies.inverse_inertia.push_back(six(inverse_inertia, i));
  op.jacobian.reserve(m);
  for (std::size_t i = 0; i < m; ++i)
    op.jacobian.push_back({body_a(i), body_b(i), six(jacobian_a, i), six(jacobian_b, i)});
  op.compliance.assign(compliance.data(), compliance.data() + m);
  return op;
}

OperatorHandle contacts(Vector inverse_mass, Matrix inverse_inertia, IndexVector body_a, IndexVector body_b,
                        Matrix r_a, Matrix r_b, Matrix normal, Matrix direction, IndexVector rows,
                        Vector moment_length, Vector compliance, IndexVector joint_body_a,
                        IndexVector joint_body_b, Matrix joint_jacobian_a, Matrix joint_jacobian_b,
                        Vector joint_compliance) {
  const std::size_t n = body_a.shape(0);
  bool fit =
      body_b.shape(0) == n && rows.shape(0) == n && moment_length.shape(0) == n && compliance.shape(0) == n;
  for (const Matrix* a : {&r_a, &r_b, &normal, &direction}) fit = fit && a->shape(0) == n && a->shape(1) == 3;
  AMONTONS_REQUIRE(fit, "contacts: the arrays differ in length");
  ContactSystem op = rows_of(inverse_mass, inverse_inertia, joint_body_a, joint_body_b, joint_jacobian_a,
                             joint_jacobian_b, joint_compliance);
  op.contacts.reserve(n);
  for (std::size_t c = 0; c < n; ++c) {
    op.contacts.push_back(contact_between(body_a(c), body_b(c), vec3(r_a, c), vec3(r_b, c), vec3(normal, c)));
    op.contacts.back().direction = vec3(direction, c);
    op.contacts.back().rows = rows(c);
    op.contacts.back().moment_length = moment_length(c);
  }
  op.contact_compliance.assign(compliance.data(), compliance.data() + n);
  return {std::move(op)};
}

// The stored rows of a contact operator: (body_a, body_b, jacobian_a, jacobian_b, compliance), with flattened
// matrices.
nb::tuple stored(const OperatorHandle& handle) {
  const auto* op = std::get_if<ContactSystem>(&handle.get());
  AMONTONS_REQUIRE(op != nullptr, "stored: this operator has no contacts");
  const ContactSystem rows = op->stored();
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
  nb::class_<OperatorHandle>(m, "Operator", "A symmetric positive semidefinite map, one of four kinds.")
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
        return OperatorHandle{rows_of(mass, inertia, body_a, body_b, a, b, e)};
      },
      nb::arg("inverse_mass"), nb::arg("inverse_inertia"), nb::arg("body_a"), nb::arg("body_b"),
      nb::arg("jacobian_a"), nb::arg("jacobian_b"), nb::arg("compliance"));
  m.def("contact_operator", &contacts, nb::arg("inverse_mass"), nb::arg("inverse_inertia"), nb::arg("body_a"),
        nb::arg("body_b"), nb::arg("r_a"), nb::arg("r_b"), nb::arg("normal"), nb::arg("direction"),
        nb::arg("rows"), nb::arg("moment_length"), nb::arg("compliance"), nb::arg("joint_body_a"),
        nb::arg("joint_body_b"), nb::arg("joint_jacobian_a"), nb::arg("joint_jacobian_b"),
        nb::arg("joint_compliance"));
  m.def(
      "contact_tangents",
      [](Matrix normals, Matrix directions) {
        std::vector<double> t;
        for (std::size_t i = 0; i < normals.shape(0); ++i) {
          const ContactBasis basis(vec3(normals, i), vec3(directions, i));
          for (const Vec3& v : {basis.tangent_1, basis.tangent_2}) t.insert(t.end(), {v.x, v.y, v.z});
        }
        return to_numpy(std::move(t));
      },
      nb::arg("normals"), nb::arg("directions"),
      "Both tangents of every contact, six numbers each; the first along the direction unless that is zero.");
}

}  // namespace amontons::python
