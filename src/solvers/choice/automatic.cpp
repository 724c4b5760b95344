// method = "auto": picks by the structure of the problem and says so in Solution::reason. Every phase has a
// limit, so that the work is bounded also where the tolerance cannot be reached. The thresholds come from
// benchmarks/steps.py and benchmarks/sequences.py; see docs/methods.md.
#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/solvers/choice/islands.hpp"
#include "amontons/solvers/driver/chain.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/driver/phases.hpp"

namespace amontons {

namespace {

// Bodies, or rows of a matrix, that are factored without a thought.
constexpr std::size_t largest_factor = 5000;
// Seconds per block that an interior-point solve takes, with room: a wall of 8684 contacts takes 0.3 s.
constexpr double factored_cost = 5e-5;
// First-order iterations from a warm start, before anything is factored.
constexpr std::size_t warm_iterations = 200;
// Below so many blocks a Newton step is cheap beside the first-order iterations that it replaces.
constexpr std::size_t few_blocks = 1000;
// Iterations of the interior point: it takes ten to thirty where it converges as it should. Where blocks are
// few, more are worth while.
constexpr std::size_t path_iterations = 30;
// Iterations times blocks of the last first-order phase: about 0.2 s of fused passes. A step that is still
// above its tolerance then gains little from more.
constexpr std::size_t last_work = 13'000'000;
constexpr std::size_t direct_iterations = 200;  // of the factored conjugate gradients

// A frozen path gains one or two digits: it is worth its factorisations where that brings the tolerance into
// reach, and where the first-order iterations got nowhere.
template <int factor>
bool path_pays(const Problem&, const Options& options, const Solution& best) {
  constexpr double poor = 4e-3;
  return best.residual < factor * options.tolerance || best.residual > poor;
}

// The unknowns of a factorisation: bodies or blocks.
std::size_t factor_nodes(const Problem& problem) {
  if (const auto* bodies = std::get_if<BodyOperator>(&problem.A)) return bodies->inverse_mass.bodies();
  if (const auto* contacts = std::get_if<ContactOperator>(&problem.A))
    return contacts->joints.inverse_mass.bodies();
  return problem.rows();
}

std::size_t last_iterations(const Problem& problem) {
  return std::clamp<std::size_t>(last_work / std::max<std::size_t>(1, problem.K.blocks()), 500, 20000);
}

// First-order iterations before anything is factored.
std::size_t first_iterations(const Problem& problem) {
  return std::clamp<std::size_t>(problem.K.blocks() / 6, 50, 1000);
}

std::vector<Phase> coulomb_phases(const Problem& problem) {
  const std::size_t blocks = problem.K.blocks(), first = first_iterations(problem);
  if (blocks > few_blocks) {
    // First-order methods are slow on chains of joints: where those abound the path comes in any case.
    const bool jointed = blocks - problem.K.contacts() > problem.K.contacts() / 2;
    return {{apgd, first},
            {frozen_path, path_iterations, false, jointed ? nullptr : path_pays<100>},
            {frozen_path, path_iterations, false, jointed ? path_pays<100> : path_pays<20>},
            {apgd, last_iterations(problem)},
            {central_path, 2 * path_iterations, true, path_pays<0>}};
  }
  return {{apgd, first},
          {central_path, 2 * path_iterations},
          {apgd, 4000},
          {newton, 8},
          {apgd, last_iterations(problem)},
          {newton, 10, true},
          {gauss_seidel, 2000, true}};
}

Solution solve_one(const Problem& problem, const Options& options) {
  const std::size_t nodes = factor_nodes(problem);
  const bool function = std::holds_alternative<CallbackOperator>(problem.A);
  const bool too_many = nodes > largest_factor;
  const bool hurried = options.deadline < factored_cost * static_cast<double>(problem.K.blocks());
  // Without friction the laws are one.
  const auto& mu = problem.K.mu();
  const bool coulomb =
      options.law == Law::coulomb && std::any_of(mu.begin(), mu.end(), [](double m) { return m > 0; });
  std::vector<Phase> phases;
  std::string why;
  if (problem.K.all_free()) {
    // Contradictory rows end in the last phase, which runs off along the contradiction and so proves it.
    phases = {{cg, last_iterations(problem)}, {spg, warm_iterations}};
    if (!function && !too_many) phases.insert(phases.begin(), {factored_cg, direct_iterations});
    why = "all rows are bilateral, a linear system";
  } else if (function || too_many || hurried) {
    // The accelerated method is the steadier one on hyperstatic contacts, the spectral one on joints.
    if (coulomb)
      phases = {{apgd, 2 * last_iterations(problem)}, {spg, last_iterations(problem)}};
    else
      phases = {{spg}};
    why = function   ? "A is a function, which cannot be factored"
          : too_many ? std::to_string(nodes) + " unknowns are too many to factor (limit " +
                           std::to_string(largest_factor) + ")"
                     : "the deadline is too short to factor";
  } else {
    if (coulomb) {
      phases = coulomb_phases(problem);
    } else {
      // On many contacts the accelerated method gets further from a warm start, on joints the spectral one.
      const bool piled = problem.K.contacts() > few_blocks;
      if (!options.x0.empty())
        phases.push_back(piled ? Phase{apgd, 2 * first_iterations(problem)} : Phase{spg, warm_iterations});
      phases.push_back({interior_point});
    }
    why = "A is small enough to factor; the order is ";
    why += coulomb              ? "apgd, interior-point, apgd"
           : options.x0.empty() ? "interior-point"
                                : "a first-order method from the warm start, interior-point";
  }
  // A caller with limits of his own gets what they allow.
  if (options.max_iterations > 0 || std::isfinite(options.deadline)) {
    if (coulomb && !function && !too_many && !hurried) phases.push_back({frozen_path, 2 * path_iterations});
    phases.push_back({coulomb ? apgd : spg});
  }
  Solution s = run_phases(problem, options, phases);
  s.reason = "auto picked " + s.method + ": " + why;
  return s;
}

}  // namespace

Solution automatic(const Problem& problem, const Options& options) {
  return solve_by_islands(problem, options, solve_one);
}

}  // namespace amontons
