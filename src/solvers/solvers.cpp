#include "amontons/solvers/solvers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "amontons/base/budget.hpp"
#include "amontons/base/error.hpp"

namespace amontons {

namespace {

// One function pointer per method: one indirect call per solve, none inside. A new method needs a line here
// and a section in docs/methods.md.
constexpr std::array<std::pair<std::string_view, Method>, 11> methods{{
    {"auto", static_cast<Method>(automatic)},
    {"p-spg-fb", spg},
    {"p-spg-fb-literal", spg_literal},
    {"jacobi", jacobi},
    {"gauss-seidel", gauss_seidel},
    {"apgd", apgd},
    {"cg", cg},
    {"minres", minres},
    {"admm", admm},
    {"interior-point", interior_point},
    {"newton", newton},
}};

// Time for the work after the last iteration (s), which the deadline includes: products and natural maps of
// the whole problem; at most a tenth of the deadline.
double ending(const Problem& problem, double deadline) {
  // Time of that work (s per block), and its limit (relative to the deadline).
  constexpr double per_block = 2e-7, most = 0.1;
  if (!std::isfinite(deadline)) return 0;
  return std::min(per_block * static_cast<double>(problem.K.blocks()), most * deadline);
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
  std::string known;
  for (const auto& [other, method] : methods) {
    if (other == name) return method;
    known += (known.empty() ? "" : ", ") + std::string(other);
  }
  throw InputError("unknown method '" + std::string(name) + "'; the methods are " + known);
}

Solution solve(const Problem& problem, std::string_view method, const Options& options) {
  const Method run = find_method(method);
  validate(options, problem);
  Options in_time = options;
  in_time.deadline -= ending(problem, options.deadline);
  if (!has_passes(method)) in_time.iterates = nullptr;
  const Budget budget(in_time.deadline, options.interrupted);
  // Only these need no more of A than products; `auto` knows trees.
  if (has_trees(problem) && !has_passes(method)) return run(as_matrix(problem), in_time);
  return run(problem, in_time);
}

}  // namespace amontons
