#include <cstring>

#include "amontons/base/leave.hpp"
#include "amontons/collision/broad_phase.hpp"
#include "amontons/solvers/first_order/device_layout.hpp"
#include "amontons/solvers/first_order/forwarded_iterate.hpp"
#include "bindings.hpp"

namespace amontons::python {

namespace {

// An object of Python that lives as long as solvers want it, which do not hold the lock of the interpreter.
using Held = std::shared_ptr<nb::object>;
Held hold(nb::object object) {
  return {new nb::object(std::move(object)), [](nb::object* p) {
            nb::gil_scoped_acquire gil;
            delete p;
          }};
}

double number(const nb::object& result, const char* pass) {
  if (const double value = PyFloat_AsDouble(result.ptr()); !PyErr_Occurred()) return value;
  PyErr_Clear();
  throw InputError(std::string("iterate: ") + pass + "() must return a number, not a " +
                   nb::cast<std::string>(result.type().attr("__name__")));  // the stable ABI has no tp_name
}

template <std::size_t n>
std::array<double, n> numbers(const nb::object& result, const char* pass) {
  const std::string fault =
      std::string("iterate: ") + pass + "() must return " + std::to_string(n) + " numbers";
  if (!PySequence_Check(result.ptr()) || nb::len(result) != n) throw InputError(fault);
  std::array<double, n> out;
  for (std::size_t i = 0; i < n; ++i) out[i] = number(result[i], pass);
  return out;
}

// A call of Python within a solve. A Ctrl-C that lands inside leaves the solve, whose best iterate is the
// answer: a pass may have done half its work, and no other follows it.
nb::object interruptible(auto&& call) {
  try {
    return call();
  } catch (nb::python_error& error) {
    if (!solve_scope.running || !error.matches(PyExc_KeyboardInterrupt)) throw;
  }
  solve_scope.interrupted = true;
  throw LeftEarly{true};
}

// Calls of an object of Python by the names of its functions.
class PythonObject {
 public:
  PythonObject(nb::object object, std::size_t rows) : object_(hold(std::move(object))), rows_(rows) {}
  std::size_t rows() const { return rows_; }

  template <class... Arguments>
  nb::object call(const char* name, Arguments&&... arguments) const {
    return interruptible(
        [&] { return nb::object(object_->attr(name)(std::forward<Arguments>(arguments)...)); });
  }
  template <class... Arguments>
  double one(const char* name, Arguments... arguments) const {
    nb::gil_scoped_acquire gil;
    return number(call(name, arguments...), name);
  }
  template <std::size_t n>
  std::array<double, n> several(const char* name, double argument) const {
    nb::gil_scoped_acquire gil;
    return numbers<n>(call(name, argument), name);
  }
  void none(const char* name) const {
    nb::gil_scoped_acquire gil;
    call(name);
  }
  // Outside the loop, where nobody would catch LeftEarly: once more.
  void vector(const char* name, std::span<double> x) const {
    nb::gil_scoped_acquire gil;
    nb::object result;
    try {
      result = call(name);
    } catch (const LeftEarly&) {
      result = object_->attr(name)();
    }
    Vector values;
    if (!nb::try_cast(result, values) || values.shape(0) != x.size())
      throw InputError(std::string("iterate: ") + name + "() must return an array of " +
                       std::to_string(x.size()) + " float64");
    std::copy_n(values.data(), x.size(), x.begin());
  }

 private:
  Held object_;
  std::size_t rows_;
};

// The passes of an object of Python, amontons.vi.Iterate.
class PythonIterate final : public AnyIterate {
 public:
  PythonIterate(nb::object passes, std::size_t rows) : passes_(std::move(passes), rows) {}

  double start(std::span<const double> x0) override {
    nb::gil_scoped_acquire gil;
    std::vector<double> x(passes_.rows());
    std::copy(x0.begin(), x0.end(), x.begin());
    return number(passes_.call("start", to_numpy(std::move(x))), "start");
  }
  double refresh() override { return passes_.one("refresh"); }
  Direction direction(double alpha) override {
    const auto [dg, dPd] = passes_.several<2>("direction", alpha);
    return {dg, dPd};
  }
  double curvature() override { return passes_.one("curvature"); }
  Update update(double lambda) override {
    const auto [sy, yPy, residual_squared] = passes_.several<3>("update", lambda);
    return {sy, yPy, residual_squared};
  }
  void start_momentum() override { passes_.none("start_momentum"); }
  MomentumDirection momentum_direction(double alpha) override {
    const auto [dPd, dPm] = passes_.several<2>("momentum_direction", alpha);
    return {dPd, dPm};
  }
  double accelerate(double beta) override { return passes_.one("accelerate", beta); }
  double refresh_momentum() override { return passes_.one("refresh_momentum"); }
  void keep_best() override { passes_.none("keep_best"); }
  void extract_best(std::span<double> x) const override { passes_.vector("extract_best", x); }
  void extract(std::span<double> x) const override { passes_.vector("extract", x); }
  double objective() const override { return passes_.one("objective"); }

 private:
  PythonObject passes_;
};

// Whole iterations of an object of Python, amontons.device.methods.DeviceMethod.
class PythonMethod final : public AnyMethod {
 public:
  PythonMethod(nb::object method, std::size_t rows) : method_(std::move(method), rows) {}

  double start(const char* method, std::span<const double> x0, const Settings& settings) override {
    nb::gil_scoped_acquire gil;
    nb::dict given;
    for (const auto& [name, value] : settings) given[name.c_str()] = value;
    return number(method_.call("start", method, to_numpy(std::vector<double>(x0.begin(), x0.end())), given),
                  "start");
  }
  void advance(std::size_t most, std::vector<IterationSums>& sums) override {
    nb::gil_scoped_acquire gil;
    const auto told = nb::cast<Matrix>(method_.call("advance", most));
    static_assert(sizeof(IterationSums) == 7 * sizeof(double));
    AMONTONS_REQUIRE(told.shape(1) == 7, "advance() must return (n, 7) numbers");
    sums.resize(told.shape(0));
    if (!sums.empty()) std::memcpy(sums.data(), told.data(), sums.size() * sizeof(IterationSums));
  }
  double refresh() override { return method_.one("refresh"); }
  void extract_best(std::span<double> x) const override { method_.vector("extract_best", x); }
  void extract(std::span<double> x) const override { method_.vector("extract", x); }
  double objective() const override { return method_.one("objective"); }

 private:
  PythonObject method_;
};

// make(problem, law): the object, of a problem that is alive during the solve only: passes, or with
// `as_method` whole iterations by make(problem, law, threads). With a layout it is called for problems that a
// device serves, with at least so many contacts.
std::shared_ptr<IterateSource> source(std::string name, nb::callable make, bool with_layout,
                                      std::size_t least_contacts, bool as_method) {
  auto out = std::make_shared<IterateSource>();
  out->name = std::move(name);
  out->takes = [with_layout, least_contacts](const Problem& problem) {
    // Where positions are corrected, a contact is the row of its normal.
    const std::size_t contacts = problem.K.contacts() + problem.K.all<NonNegative>().size();
    return !with_layout || (contacts >= least_contacts && DeviceLayout::fits(problem));
  };
  const auto made_as = [make = hold(std::move(make))]<class T>(T*, const Problem& problem, auto... rest) {
    nb::gil_scoped_acquire gil;
    const nb::object view = nb::cast(const_cast<Problem*>(&problem), nb::rv_policy::reference);
    return std::make_unique<T>(interruptible([&] { return nb::object((*make)(view, rest...)); }),
                               problem.rows());
  };
  if (as_method)
    out->make_method = [made_as](const Problem& problem, Law law, unsigned threads) {
      return made_as(static_cast<PythonMethod*>(nullptr), problem, law, threads);
    };
  else
    out->make = [made_as](const Problem& problem, Law law) {
      return made_as(static_cast<PythonIterate*>(nullptr), problem, law);
    };
  return out;
}

// Memory that a function of Python makes: an array of bytes, and who keeps it.
HostMemory memory_by(const nb::object& make) {
  if (make.is_none()) return {};
  return [make = hold(make)](std::size_t bytes) {
    nb::gil_scoped_acquire gil;
    nb::object made = (*make)(bytes);
    const auto array = nb::cast<nb::ndarray<std::uint8_t, nb::ndim<1>, nb::c_contig, nb::device::cpu>>(made);
    AMONTONS_REQUIRE(array.shape(0) >= bytes, "memory() must return an array of so many bytes");
    return std::shared_ptr<void>(array.data(), [owner = hold(std::move(made))](void*) {});
  };
}

// find(leaves, number, boxes, balls, placed, travels, fixed, origin): visits, and pairs as rows. The arrays
// are those of the caller, during the call only.
std::shared_ptr<PairSearch> pair_search(nb::callable find, std::size_t least, const nb::object& memory) {
  auto out = std::make_shared<PairSearch>();
  out->least = least;
  out->memory = memory_by(memory);
  out->find = [find = hold(std::move(find))](const BoxOrder& given, std::vector<IndexPair>& pairs) {
    static_assert(sizeof(Aabb) == 6 * sizeof(double) && sizeof(Ball) == 4 * sizeof(double) &&
                  sizeof(IndexPair) == 2 * sizeof(std::int32_t));
    const auto& [boxes, balls, travels, fixed, placed] = given.bounds;
    nb::gil_scoped_acquire gil;
    const auto array = [](const auto* data, auto... shape) {
      using T = std::remove_pointer_t<decltype(data)>;
      return nb::cast(nb::ndarray<nb::numpy, T>(data, {shape...}), nb::rv_policy::reference);
    };
    const nb::object told =
        (*find)(array(given.leaves.data(), given.leaves.size()), given.number,
                array(&boxes.data()->lower.x, boxes.size(), std::size_t{6}),
                array(&balls.data()->centre.x, balls.size(), std::size_t{4}), placed,
                array(&travels.data()->x, travels.size(), std::size_t{3}), array(fixed.data(), fixed.size()),
                array(&given.origin.x, std::size_t{3}));
    using Rows = nb::ndarray<const std::int32_t, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
    const auto rows = nb::cast<Rows>(told[1]);
    AMONTONS_REQUIRE(rows.shape(1) == 2, "find() must return (n, 2) numbers of boxes");
    for (std::size_t k = 0; k < rows.shape(0); ++k) pairs.emplace_back(rows(k, 0), rows(k, 1));
    return nb::cast<std::size_t>(told[0]);
  };
  return out;
}

using Layout = std::shared_ptr<DeviceLayout>;

// The arrays of a layout by their names.
template <class F>
void for_each_array(DeviceLayout& l, const F& f) {
  f("contact", l.contact);
  f("row", l.row);
  f("line", l.line);
  f("jacobian", l.jacobian);
  f("mass", l.mass);
  f("first", l.first);
  f("first_row", l.first_row);
  f("contact_list", l.contact_list);
  f("row_list", l.row_list);
  f("parts", l.parts);
  f("large", l.large);
  f("b", l.b);
}

// A view that keeps the memory of the array alive: the layout takes other memory where it grows.
template <class T>
nb::ndarray<nb::numpy, T, nb::ndim<1>> view_of_array(HostArray<T>& values) {
  auto* keep = new std::shared_ptr<void>(values.held());
  nb::capsule capsule(keep, [](void* p) noexcept { delete static_cast<std::shared_ptr<void>*>(p); });
  return {values.data(), {values.size()}, capsule};
}

void require_fit(const Problem& problem) {
  AMONTONS_REQUIRE(DeviceLayout::fits(problem), "the passes of a device do not know this problem");
}

std::span<const double> checked(const Vector& x, std::size_t size, const char* what) {
  AMONTONS_REQUIRE(x.shape(0) == size, std::string(what) + " has " + std::to_string(x.shape(0)) +
                                           " entries in place of " + std::to_string(size));
  return view(x);
}

void bind_layout(nb::module_& m) {
  nb::class_<DeviceLayout>(m, "DeviceLayout", "The arrays of the passes, as a device reads them.")
      .def(nb::new_([](const Problem& problem, unsigned threads, const nb::object& memory) {
             require_fit(problem);
             const HostMemory made = memory_by(memory);
             nb::gil_scoped_release release;
             return std::make_shared<DeviceLayout>(problem, threads, made);
           }),
           nb::arg("problem"), nb::arg("threads") = 0, nb::arg("memory") = nb::none())
      .def(
          "fill",
          [](DeviceLayout& l, const Problem& problem, unsigned threads) {
            require_fit(problem);
            nb::gil_scoped_release release;
            l.fill(problem, threads);
          },
          nb::arg("problem"), nb::arg("threads") = 0, "Another problem in the same memory.")
      .def_static("fits", &DeviceLayout::fits, nb::arg("problem"),
                  "Whether it has bodies, circular friction cones and single rows, and nothing else.")
      .def_ro("contacts", &DeviceLayout::contacts)
      .def_ro("rows", &DeviceLayout::rows, "Single rows.")
      .def_ro("bodies", &DeviceLayout::bodies, "That impulses move.")
      .def_ro("stride", &DeviceLayout::stride)
      .def_ro("row_stride", &DeviceLayout::row_stride)
      .def_ro("line_stride", &DeviceLayout::line_stride)
      .def_ro("stored", &DeviceLayout::stored, "Contacts are rows of D.")
      .def_ro("compliant", &DeviceLayout::compliant)
      .def_prop_ro("size", &DeviceLayout::size, "Of a vector of the passes.")
      .def(
          "arrays",
          [](DeviceLayout& l) {
            nb::dict d;
            for_each_array(l,
                           [&](const char* name, auto& values) { d[name] = view_of_array(values).cast(); });
            return d;
          },
          "Views by name; include/amontons/solvers/first_order/device_layout.hpp.")
      .def(
          "changed",
          [](DeviceLayout& l) {
            std::vector<std::string> names;
            for_each_array(l, [&](const char* name, const auto& values) {
              if (values.changed) names.emplace_back(name);
            });
            return names;
          },
          "Names of the arrays that differ from those of the problem before.")
      .def(
          "start",
          [](DeviceLayout& l, Vector x0) {
            l.start(checked(x0, 3 * l.contacts + l.rows, "x0"));
            return view_of_array(l.x);
          },
          nb::arg("x0"), "Pi_K of x0, (m,), in the order and the axes of the passes, (size,).")
      .def(
          "to_user",
          [](const DeviceLayout& l, Vector held) {
            std::vector<double> x(3 * l.contacts + l.rows);
            l.to_user(checked(held, l.size(), "held"), x);
            return to_numpy(std::move(x));
          },
          nb::arg("held"), "The way back: (m,) of (size,).");
}

}  // namespace

void bind_iterate(nb::module_& m) {
  nb::class_<IterateSource>(m, "IterateSource", "Where first-order methods take their iterates from.")
      .def(nb::new_(&source), nb::arg("name"), nb::arg("make"), nb::arg("with_layout"),
           nb::arg("least_contacts"), nb::arg("as_method") = false);
  nb::class_<PairSearch>(m, "PairSearch", "Who finds boxes that overlap, in place of the library.")
      .def(nb::new_(&pair_search), nb::arg("find"), nb::arg("least"), nb::arg("memory") = nb::none());
  bind_layout(m);
}

}  // namespace amontons::python
