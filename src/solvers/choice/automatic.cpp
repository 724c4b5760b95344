// method = "auto": a table of phases by the structure of the problem. Solution::reason is printed from the
// rows that ran. Every row has a limit, so that the work is bounded also where the tolerance cannot be
// reached. The thresholds come from benchmarks/steps.py; see docs/methods.md.
#include "amontons/solvers/choice/automatic.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/solvers/choice/islands.hpp"
#include "amontons/solvers/companions/gauss_seidel.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/first_order/apgd.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/krylov/cg.hpp"
#include "amontons/solvers/second_order/interior_point.hpp"
#include "amontons/solvers/second_order/newton.hpp"

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

constexpr std::size_t burst = 300;  // first-order iterations after a frozen path

// A frozen path gains one or two digits: it is worth its factorisations where that brings the tolerance into
// reach, and where the first-order iterations got nowhere.
template <int factor>
bool path_pays(const Options& options, const Solution& best) {
  constexpr double poor = 4e-3;
  return best.residual < factor * options.tolerance || best.residual > poor;
}

// The unknowns of a factorisation: bodies or rows.
std::size_t factor_nodes(const Problem& problem) {
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  return system ? system->bodies.size() : problem.rows();
}

std::size_t last_iterations(const Problem& problem) {
  return std::clamp<std::size_t>(last_work / std::max<std::size_t>(1, problem.K.blocks()), 500, 20000);
}

// First-order iterations before anything is factored.
std::size_t first_iterations(const Problem& problem) {
  return std::clamp<std::size_t>(problem.K.blocks() / 6, 50, 1000);
}

using Table = std::vector<Phase>;
using From = Phase::From;

// The first-order iterates know what slides long before they know the stresses of a hyperstatic stack, which
// the interior point finds at once: the path with their De Saxce term frozen and a burst that renews it do
// together in one step what either needs ten times the work for.
void add_frozen_path(Table& table, std::size_t iterations, bool (*when)(const Options&, const Solution&)) {
  table.push_back({.method = central_path,
                   .why = "finds the stresses for the friction directions so far",
                   .iterations = iterations,
                   .frozen = true,
                   .when = when});
  table.push_back({.method = apgd,
                   .why = "renews the friction directions",
                   .iterations = burst,
                   .from = From::last,
                   .follows = true});
}

Table coulomb_table(const Problem& problem) {
  const std::size_t blocks = problem.K.blocks();
  Table table{{.method = apgd, .why = "cheap where it suffices", .iterations = first_iterations(problem)}};
  if (blocks > few_blocks) {
    // First-order methods are slow on chains of joints: where those abound the path comes in any case.
    const bool jointed = blocks - problem.K.contacts() > problem.K.contacts() / 2;
    add_frozen_path(table, path_iterations, jointed ? nullptr : path_pays<100>);
    add_frozen_path(table, path_iterations, jointed ? path_pays<100> : path_pays<20>);
    table.push_back({.method = apgd, .why = "goes on from the best", .iterations = last_iterations(problem)});
    table.push_back({.method = central_path,
                     .why = "another way from the start",
                     .iterations = 2 * path_iterations,
                     .from = From::start,
                     .when = path_pays<0>});
    return table;
  }
  table.insert(
      table.end(),
      {{.method = central_path, .why = "blocks are few", .iterations = 2 * path_iterations},
       {.method = apgd, .why = "goes on from the best", .iterations = 4000},
       {.method = newton, .why = "finds the faces", .iterations = 8},
       {.method = apgd, .why = "goes on from the best", .iterations = last_iterations(problem)},
       {.method = newton, .why = "another way from the start", .iterations = 10, .from = From::start},
       {.method = gauss_seidel,
        .why = "another way from the start",
        .iterations = 2000,
        .from = From::start}});
  return table;
}

Table associated_table(const Problem& problem, const Options& options) {
  Table table;
  // On many contacts the accelerated method gets further from a warm start, on joints the spectral one.
  if (!options.x0.empty() && problem.K.contacts() > few_blocks)
    table.push_back(
        {.method = apgd, .why = "from the warm start", .iterations = 2 * first_iterations(problem)});
  else if (!options.x0.empty())
    table.push_back({.method = spg, .why = "from the warm start", .iterations = warm_iterations});
  table.push_back({.method = interior_point, .why = "factors in every iteration"});
  return table;
}

Table linear_table(const Problem& problem, bool factored) {
  Table table;
  if (factored)
    table.push_back({.method = factored_cg, .why = "one factorisation", .iterations = direct_iterations});
  table.push_back({.method = cg, .why = "a linear system", .iterations = last_iterations(problem)});
  // Contradictory rows end here, in a method that runs off along the contradiction and so proves it.
  table.push_back({.method = spg, .why = "looks for a contradiction", .iterations = warm_iterations});
  return table;
}

// The accelerated method is the steadier one on hyperstatic contacts, the spectral one on joints.
Table unfactored_table(const Problem& problem, bool coulomb) {
  if (!coulomb) return {{.method = spg, .why = "nothing to factor"}};
  return {{.method = apgd, .why = "nothing to factor", .iterations = 2 * last_iterations(problem)},
          {.method = spg, .why = "goes on from the best", .iterations = last_iterations(problem)}};
}

// The table, and why it was chosen.
struct Choice {
  Table table;
  std::string why;
};

Choice choose(const Problem& problem, const Options& options) {
  const std::size_t nodes = factor_nodes(problem);
  const bool function = std::holds_alternative<CallbackOperator>(problem.A);
  const bool too_many = nodes > largest_factor;
  const bool hurried = options.deadline < factored_cost * static_cast<double>(problem.K.blocks());
  // Without friction the laws are one.
  const bool coulomb = options.law == Law::coulomb && problem.K.has_friction();
  Choice choice;
  if (problem.K.all_free()) {
    choice = {linear_table(problem, !function && !too_many), "all rows are bilateral, a linear system"};
  } else if (function || too_many || hurried) {
    choice.table = unfactored_table(problem, coulomb);
    choice.why = function   ? "A is a function, which cannot be factored"
                 : too_many ? std::to_string(nodes) + " unknowns are too many to factor (limit " +
                                  std::to_string(largest_factor) + ")"
                            : "the deadline is too short to factor";
  } else {
    choice = {coulomb ? coulomb_table(problem) : associated_table(problem, options),
              "A is small enough to factor"};
  }
  // A caller with limits of his own gets what they allow.
  if (options.max_iterations > 0 || std::isfinite(options.deadline)) {
    if (coulomb && !function && !too_many && !hurried)
      add_frozen_path(choice.table, 2 * path_iterations, nullptr);
    choice.table.push_back({.method = coulomb ? apgd : spg, .why = "what the limits of the caller allow"});
  }
  return choice;
}

Solution solve_one(const Problem& problem, const Options& options) {
  const Choice choice = choose(problem, options);
  Solution s = run_phases(problem, options, choice.table);
  s.reason = choice.why + ": " + describe(s.phases);
  return s;
}

}  // namespace

Solution automatic(const Problem& problem, const Options& options) {
  return solve_by_islands(problem, options, solve_one);
}

}  // namespace amontons
