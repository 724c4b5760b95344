#include "amontons/solvers/solvers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "amontons/base/budget.hpp"
#include "amontons/base/error.hpp"
#include "amontons/base/interrupt.hpp"

namespace amontons {

namespace {

// One function pointer per method: one indirect call per solve, none inside. A new method needs a line here
// and a section in docs/methods.md.
constexpr std::array<std::pair<std::string_view, Method>, 10> methods{{
    {"auto", static_cast<Method>(automatic)},
    {"p-spg-fb", spg},
    {"p-spg-fb-literal", spg_literal},
    {"jacobi", jacobi},
    {"gauss-seidel", gauss_seidel},
    {"apgd", apgd},
    {"cg", cg},
    {"minres", minres},
    {"interior-point", interior_point},
    {"newton", newton},
}};

// Time for the work after the last iteration (s), which the deadline includes: products and natural maps of
// the whole problem; at most a tenth of `time`.
double ending(const Problem& problem, double time) {
  // Time of that work (s per block), and its limit (relative to the time of the solve).
  constexpr double per_block = 2e-7, most = 0.1;
  if (!std::isfinite(time)) return 0;
  return std::min(per_block * static_cast<double>(problem.K.blocks()), most * time);
}

// Whether the method is written over Iterate. Other methods, some of which call these, stay on the processor.
bool has_passes(std::string_view method) {
  return method == "auto" || method == "p-spg-fb" || method == "apgd";
}

}  // namespace

const std::vector<std::string_view>& method_names() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> list;
    for (const auto& [name, method] : methods) list.push_back(name);
    return list;
  }();
  return names;
}

Method find_method(std::string_view name) {
  // Programs for earlier versions learn what to use: it factors the same matrix, and reaches the last digits.
  AMONTONS_REQUIRE(name != "admm", "method 'admm' was removed; use 'interior-point'");
  std::string known;
  for (const auto& [other, method] : methods) {
    if (other == name) return method;
    known += (known.empty() ? "" : ", ") + std::string(other);
  }
  throw InputError("unknown method '" + std::string(name) + "'; the methods are " + known);
}

Solution solve(const Problem& problem, std::string_view method, const Options& options) {
  Budget whole;
  return solve(problem, method, options, whole);
}

Solution solve(const Problem& problem, std::string_view method, const Options& options, Budget& whole) {
  const Method run = find_method(method);
  validate(options, problem);
  const Interrupt interrupt(options.interrupted);
  const double time = std::min(options.deadline, whole.left());
  Budget budget(whole, time - ending(problem, time));
  Options own = options;
  if (!has_passes(method)) own.iterates = nullptr;
  Solution s = run(problem, own, budget);
  // The direct way, races and islands share this budget, so that nothing that they try is left out.
  s.work = budget.spent();
  return s;
}

}  // namespace amontons
