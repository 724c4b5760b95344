#include "amontons/solvers/driver/options.hpp"
#include "bindings.hpp"

namespace amontons::python {

const char* name_of(Status status) {
  switch (status) {
    case Status::converged:
      return "converged";
    case Status::iteration_limit:
      return "iteration_limit";
    case Status::deadline:
      return "deadline";
    case Status::stalled:
      return "stalled";
    case Status::interrupted:
      return "interrupted";
    case Status::made_safe:
      return "made_safe";
    case Status::infeasible:
      return "infeasible";
  }
  return "stalled";
}

namespace {

// The history as raw bytes of IterationRecord; the package views it as a structured array.
nb::ndarray<nb::numpy, std::uint8_t, nb::ndim<1>> history_of(const std::shared_ptr<Solution>& s) {
  static_assert(sizeof(IterationRecord) == 64 && sizeof(std::size_t) == 8,
                "the dtype in python/amontons/problem/solution.py mirrors IterationRecord");
  auto* keep = new std::shared_ptr<Solution>(s);
  nb::capsule owner(keep, [](void* p) noexcept { delete static_cast<std::shared_ptr<Solution>*>(p); });
  return {reinterpret_cast<std::uint8_t*>(s->history.data()),
          {s->history.size() * sizeof(IterationRecord)},
          owner};
}

}  // namespace

void bind_solution(nb::module_& m) {
  nb::class_<IterationRecord>(m, "IterationRecord",
                              "An iteration, as the callback of a solve gets it.\n\n"
                              ">>> def stop(record):\n"
                              "...     return record.iteration >= 3\n"
                              ">>> problem = vi.read_problem(examples.path(\"wall_impact.hdf5\"))\n"
                              ">>> problem.solve(method=\"apgd\", callback=stop).iterations\n"
                              "3")
      .def_ro("iteration", &IterationRecord::iteration, "0 for the starting point")
      .def_ro("products", &IterationRecord::products, "products with A so far")
      .def_ro("time", &IterationRecord::time, "s since the start of the solve")
      .def_ro("residual", &IterationRecord::residual, "natural residual of the current iterate")
      .def_ro("best_residual", &IterationRecord::best_residual, "natural residual of the best iterate so far")
      .def_ro("objective", &IterationRecord::objective, "1/2 x'Ax + b'x of the current iterate (J)")
      .def_ro("step", &IterationRecord::step, "step size, penalty or step length of the method; 0 if none")
      .def_ro("backtracks", &IterationRecord::backtracks, "backtracking steps of the line search")
      .def("__repr__", [](const IterationRecord& r) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "IterationRecord(iteration=%zu, products=%zu, residual=%.3e, best_residual=%.3e)",
                      r.iteration, r.products, r.residual, r.best_residual);
        return std::string(text);
      });
  using Handle = std::shared_ptr<Solution>;
  nb::class_<Solution>(m, "Result", "A solution; the arrays view its memory.")
      .def_prop_ro(
          "x", [](const Handle& s) { return view_of(s->x, s); }, nb::rv_policy::automatic)
      .def_prop_ro(
          "u", [](const Handle& s) { return view_of(s->u, s); }, nb::rv_policy::automatic)
      .def_prop_ro("status", [](const Solution& s) { return name_of(s.status); })
      .def_ro("residual", &Solution::residual)
      .def_ro("objective", &Solution::objective)
      .def_ro("iterations", &Solution::iterations)
      .def_ro("products", &Solution::products)
      .def_ro("work", &Solution::work)
      .def_ro("factorizations", &Solution::factorizations)
      .def_ro("time", &Solution::time)
      .def_ro("method", &Solution::method)
      .def_ro("device", &Solution::device)
      .def_ro("reason", &Solution::reason)
      .def_prop_ro("phases",
                   [](const Solution& s) {
                     nb::list phases;
                     for (const PhaseRecord& p : s.phases)
                       phases.append(nb::make_tuple(p.method, p.why, p.iterations, p.residual));
                     return phases;
                   })
      .def_prop_ro("history", &history_of, nb::rv_policy::automatic);
}

}  // namespace amontons::python
