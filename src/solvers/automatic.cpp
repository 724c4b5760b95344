// method = "auto": picks by the structure of the problem and says so in Solution::reason. The thresholds come
// from benchmarks/steps.py; see docs/methods.md.
#include <string>

#include "amontons/solvers/chain.hpp"
#include "amontons/solvers/solvers.hpp"

namespace amontons {

namespace {

// Bodies, or rows of a matrix, that are factored without a thought.
constexpr std::size_t largest_factor = 5000;
// Seconds per block that an interior-point solve takes, with room: a wall of 8684 contacts takes 0.3 s.
constexpr double factored_cost = 5e-5;
// First-order iterations from a warm start, before anything is factored.
constexpr std::size_t warm_iterations = 200;
// Sweeps of Gauss-Seidel at the end under coulomb: slow, but it settles contacts with large mu one by one.
constexpr std::size_t last_sweeps = 5000;

// The unknowns of a factorisation: bodies or blocks.
std::size_t factor_nodes(const Problem& problem) {
  if (const auto* bodies = std::get_if<BodyOperator>(&problem.A)) return bodies->inverse_mass.bodies();
  if (const auto* contacts = std::get_if<ContactOperator>(&problem.A))
    return contacts->joints.inverse_mass.bodies();
  return problem.rows();
}

}  // namespace

Solution automatic(const Problem& problem, const Options& options) {
  const std::size_t nodes = factor_nodes(problem);
  const bool function = std::holds_alternative<CallbackOperator>(problem.A);
  const bool too_many = nodes > largest_factor;
  const bool hurried = options.deadline < factored_cost * static_cast<double>(problem.K.blocks());
  std::vector<Phase> phases;
  std::string why;
  if (problem.K.all_free()) {
    phases = {{cg}};
    if (!function && !too_many) phases = {{cg, 2000}, {interior_point}};
    why = "all rows are bilateral, a linear system";
  } else if (function || too_many || hurried) {
    phases = {{spg}};
    why = function   ? "A is a function, which cannot be factored"
          : too_many ? std::to_string(nodes) + " unknowns are too many to factor (limit " +
                           std::to_string(largest_factor) + ")"
                     : "the deadline is too short to factor";
  } else {
    if (!options.x0.empty()) phases.push_back({spg, warm_iterations});
    phases.push_back({interior_point});
    if (options.law == Law::coulomb) {
      phases.push_back({newton, 0, true});
      phases.push_back({gauss_seidel, last_sweeps, true});
    }
    why = std::string("A is small enough to factor; the order is ") +
          (options.x0.empty() ? "" : "p-spg-fb from the warm start, ") + "interior-point" +
          (options.law == Law::coulomb ? ", newton, gauss-seidel" : "");
  }
  Solution s = run_phases(problem, options, phases);
  s.reason = "auto picked " + s.method + ": " + why;
  return s;
}

}  // namespace amontons
