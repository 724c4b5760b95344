#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "amontons/base/error.hpp"
#include "amontons/problem/operators.hpp"
#include "amontons/solvers/driver/options.hpp"

// The module amontons._core: a thin layer over the C++ types. The package in python/amontons converts user
// input to the array types listed here and contains the documentation.
namespace amontons::python {

namespace nb = nanobind;

using Vector = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Matrix = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using IndexVector = nb::ndarray<const Index, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using OutVector = nb::ndarray<nb::numpy, double, nb::ndim<1>>;
using OutMatrix = nb::ndarray<nb::numpy, double, nb::ndim<2>>;

inline std::span<const double> view(const Vector& a) { return {a.data(), a.shape(0)}; }
inline std::span<const Index> view(const IndexVector& a) { return {a.data(), a.shape(0)}; }

// A NumPy array over memory that `owner` keeps alive.
template <class Owner>
OutVector view_of(const std::vector<double>& values, const std::shared_ptr<Owner>& owner) {
  auto* keep = new std::shared_ptr<Owner>(owner);
  nb::capsule capsule(keep, [](void* p) noexcept { delete static_cast<std::shared_ptr<Owner>*>(p); });
  return OutVector(const_cast<double*>(values.data()), {values.size()}, capsule);
}

// A writable (rows, columns) array over memory that `owner` keeps alive.
template <class T, class Owner>
nb::ndarray<nb::numpy, T, nb::ndim<2>> matrix_view(T* data, std::size_t rows, std::size_t columns,
                                                   const std::shared_ptr<Owner>& owner) {
  auto* keep = new std::shared_ptr<Owner>(owner);
  nb::capsule capsule(keep, [](void* p) noexcept { delete static_cast<std::shared_ptr<Owner>*>(p); });
  return nb::ndarray<nb::numpy, T, nb::ndim<2>>(data, {rows, columns}, capsule);
}

// A NumPy array that takes ownership of a vector, as (n,) or as rows of (n / columns, columns). Without
// columns there are no rows either: the matrix of a problem without rows.
template <class T>
nb::ndarray<nb::numpy, T, nb::ndim<1>> to_numpy(std::vector<T> values) {
  auto* owner = new std::vector<T>(std::move(values));
  nb::capsule capsule(owner, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::ndarray<nb::numpy, T, nb::ndim<1>>(owner->data(), {owner->size()}, capsule);
}
template <class T>
nb::ndarray<nb::numpy, T, nb::ndim<2>> to_numpy(std::vector<T> values, std::size_t columns) {
  auto owner = std::make_shared<std::vector<T>>(std::move(values));
  return matrix_view(owner->data(), columns > 0 ? owner->size() / columns : 0, columns, owner);
}

// An operator before it becomes part of a Problem, which takes it without copying its arrays.
struct OperatorHandle {
  Operator op;
  bool taken = false;

  const Operator& get() const {
    AMONTONS_REQUIRE(!taken, "this operator was handed over to a problem; build another one");
    return op;
  }
};

// Returns a simulation that no other thread is stepping. Data that a step changes are read and written under
// the lock of the interpreter, which a step does not hold.
template <class S>
S& idle(S& s) {
  AMONTONS_REQUIRE(!s.stepping(),
                   "this simulation is in the middle of a step on another thread; give each thread a copy");
  return s;
}

const char* name_of(Status status);

// Set while a solve runs on this thread. A Ctrl-C inside a Python product is stored here until the solver
// polls, since a product cannot return "stop".
struct SolveScope {
  bool running = false, interrupted = false;
};
inline thread_local SolveScope solve_scope;

// One function per bound type; module.cpp calls them in the order of their dependencies.
void bind_cones(nb::module_& m);
void bind_operators(nb::module_& m);
void bind_problem(nb::module_& m);
void bind_iterate(nb::module_& m);
void bind_options(nb::module_& m);
void bind_solution(nb::module_& m);
void bind_solve(nb::module_& m);
void bind_shapes(nb::module_& m);
void bind_model(nb::module_& m);
void bind_state(nb::module_& m);
void bind_simulation(nb::module_& m);
void bind_tables(nb::module_& m);
void bind_kinematics(nb::module_& m);
void bind_worlds(nb::module_& m);
void bind_held_step(nb::module_& m);
void bind_picture(nb::module_& m);

}  // namespace amontons::python
