#include "amontons/solvers/solvers.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "amontons/base/error.hpp"
#include "amontons/solvers/driver/phases.hpp"

namespace amontons {

namespace {

constexpr std::array<std::pair<std::string_view, Method>, 11> methods{{
    {"auto", automatic},
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

}  // namespace

const std::vector<std::string_view>& method_names() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> list;
    for (const auto& [name, method] : methods) list.push_back(name);
    return list;
  }();
  return names;
}

Solution solve(const Problem& problem, std::string_view method, const Options& options) {
  const auto found =
      std::find_if(methods.begin(), methods.end(), [&](const auto& m) { return m.first == method; });
  if (found == methods.end()) {
    std::string known;
    for (std::string_view name : method_names()) known += (known.empty() ? "" : ", ") + std::string(name);
    throw InputError("unknown method '" + std::string(method) + "'; the methods are " + known);
  }
  validate(options, problem);
  return found->second(problem, options);
}

}  // namespace amontons
