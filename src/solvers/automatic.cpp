// method = "auto": picks by the structure of the problem and says so in Solution::reason. The thresholds come
// from benchmarks/steps.py; see docs/methods.md.
#include <string>

#include "amontons/solvers/chain.hpp"
#include "amontons/solvers/solvers.hpp"

namespace amontons {

namespace {

constexpr std::size_t largest_factor =
    5000;                               // bodies, or rows of a matrix, that are factored without a thought
constexpr double factored_cost = 1e-4;  // s per contact, what an interior-point solve takes, generously
constexpr std::size_t warm_iterations = 200;  // of the first-order method, when there is a warm start

// The unknowns of a factorisation: bodies or blocks.
std::size_t factor_nodes(const Problem& problem) {
  if (const auto* bodies = std::get_if<BodyOperator>(&problem.A)) return bodies->inverse_mass.bodies();
  if (const auto* contacts = std::get_if<ContactOperator>(&problem.A))
    return contacts->joints.inverse_mass.bodies();
  return problem.rows();
}

}  // namespace

Solution automatic(const Problem& problem, const Options& options) {
  const bool callback = std::holds_alternative<CallbackOperator>(problem.A);
  const std::size_t nodes = factor_nodes(problem);
  std::vector<Phase> phases;
  std::string why;
  if (callback) {
    phases = {{spg}};
    why = "A is a function, which cannot be factored";
  } else if (nodes > largest_factor) {
    phases = {{spg}};
    why = std::to_string(nodes) + " unknowns are too many to factor (limit " +
          std::to_string(largest_factor) + ")";
  } else if (problem.K.all_free()) {
    phases = {{cg, 2000}, {interior_point}};
    why = "all rows are bilateral: a linear system";
  } else if (options.deadline < factored_cost * static_cast<double>(problem.K.blocks())) {
    phases = {{spg}};
    why = "the deadline is too short for factorisations";
  } else {
    if (!options.x0.empty()) phases.push_back({spg, warm_iterations});
    phases.push_back({interior_point});
    phases.push_back({spg});
    why = "few enough bodies to factor in every iteration";
    if (!options.x0.empty()) why += ", after a first-order attempt from the warm start";
  }
  Solution s = run_phases(problem, options, phases);
  s.reason = "auto picked " + s.method + ": " + why;
  return s;
}

}  // namespace amontons
