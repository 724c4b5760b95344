// method = "auto": a table of phases by the structure of the problem. Solution::reason is printed from the
// rows that ran. Every row has a limit, so that the work is bounded also where the tolerance cannot be
// reached. The thresholds come from benchmarks/steps.py; see docs/methods.md.
//
// Three facts about the methods make the tables:
//
//   - First-order iterations cost a pass over the contacts, some 15 ns for each, and soon know which of them
//     slide; their count grows with the condition, so that stresses in high or hyperstatic stacks, chains of
//     joints and mass ratios take tens of thousands.
//   - A step with a factorisation costs some hundred of those, but the condition hardly matters to it.
//   - Under coulomb no method is proven to converge: several ways to a solution are worth more than one way
//     gone far, and a limit per row is what lets the next one try.
#include "amontons/solvers/choice/automatic.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/solvers/choice/islands.hpp"
#include "amontons/solvers/companions/gauss_seidel.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/elimination/elimination.hpp"
#include "amontons/solvers/first_order/apgd.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/krylov/cg.hpp"
#include "amontons/solvers/second_order/interior_point.hpp"
#include "amontons/solvers/second_order/newton.hpp"

namespace amontons {

namespace {

// Bodies, or rows of a matrix, that are factored without a thought: a dense matrix of 5000 rows takes 200 MB
// and seconds for each factorisation, and bodies in a heap fill their factor up as well.
constexpr std::size_t largest_factor = 5000;
// Seconds per block that an interior-point solve takes, with room: a wall of 8684 contacts takes 0.3 s.
constexpr double factored_cost = 5e-5;
// First-order iterations from a warm start, before anything is factored: enough to correct a start that is
// near, and cheap beside a factorisation where it is not.
constexpr std::size_t warm_iterations = 200;
// Below so many blocks a Newton step is cheap beside the first-order iterations that it replaces.
constexpr std::size_t few_blocks = 1000;
// Iterations of the interior point: it takes ten to thirty where it converges as it should. Where blocks are
// few, more are worth while.
constexpr std::size_t path_iterations = 30;
// Iterations times blocks of the last first-order phase: about 0.2 s of fused passes. A step that is still
// above its tolerance then gains little from more.
constexpr std::size_t last_work = 13'000'000;
// Of the factored conjugate gradients, which take a few where the factorisation is good.
constexpr std::size_t direct_iterations = 200;
// Why the direct way was taken.
constexpr const char* eliminated = "bilateral rows are eliminated, islands are small";
// First-order iterations after a frozen path: the path changes velocities, and with them the De Saxce terms,
// which those iterations renew until the residual is below that of the frozen problem.
constexpr std::size_t burst = 300;

// A frozen path gains one or two digits: it is worth its factorisations where that brings the tolerance into
// reach (a residual within `factor` times the tolerance), and where the first-order iterations got nowhere (a
// `poor` residual: they have not found what slides, so that more of them are no better). In between they go
// on by themselves. With factor 0 only the second counts.
template <int factor>
bool path_pays(const Options& options, const Solution& best) {
  constexpr double poor = 4e-3;
  return best.residual < factor * options.tolerance || best.residual > poor;
}

// The unknowns of a factorisation: bodies, six rows each, whatever the number of contacts between them; or
// the rows of a matrix.
std::size_t factor_nodes(const Problem& problem) {
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  return system ? system->bodies.size() : problem.rows();
}

// A given amount of work, but at least 500 iterations, below which nothing settles, and at most 20000, beyond
// which the method has stalled.
std::size_t last_iterations(const Problem& problem) {
  return std::clamp<std::size_t>(last_work / std::max<std::size_t>(1, problem.K.blocks()), 500, 20000);
}

// First-order iterations before anything is factored. News travels one block per iteration, so the more
// blocks the more of them; a wall of 8500 contacts knows what slides after some 1000.
std::size_t first_iterations(const Problem& problem) {
  return std::clamp<std::size_t>(problem.K.blocks() / 6, 50, 1000);
}

using Table = std::vector<Phase>;
using From = Phase::From;

// The two rows of a frozen path. The first-order iterates know what slides long before they know the stresses
// of a hyperstatic stack, which the interior point finds at once: the path with their De Saxce term frozen
// and a burst that renews it do together in one step what either needs ten times the work for.
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

// Coulomb with friction, A factored. The first row is enough where contacts stick, or slide as they did; the
// others are for stresses that are not found yet, and the last for an x from where no way leads on. Few
// blocks: factorisations cost no more than the iterations between them, so every method has its turn. Many:
// only frozen paths are worth their factorisations, and only where path_pays() says so.
Table coulomb_table(const Problem& problem) {
  const std::size_t blocks = problem.K.blocks();
  Table table{{.method = apgd, .why = "cheap where it suffices", .iterations = first_iterations(problem)}};
  if (blocks > few_blocks) {
    // First-order methods are slow on chains of joints: where those abound the path comes in any case.
    const bool jointed = blocks - problem.K.contacts() > problem.K.contacts() / 2;
    add_frozen_path(table, path_iterations, jointed ? nullptr : path_pays<100>);
    // The second gains less than the first.
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

// A convex problem, A factored: the interior point converges from anywhere, and makes no use of a start. So a
// warm start gets a chance first, with iterations that do.
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

// K = R^m: nothing slides or opens, the problem is a linear system for Krylov methods.
Table linear_table(const Problem& problem, bool factored) {
  Table table;
  if (factored)
    table.push_back({.method = factored_cg, .why = "one factorisation", .iterations = direct_iterations});
  table.push_back({.method = cg, .why = "a linear system", .iterations = last_iterations(problem)});
  // Contradictory rows end here, in a method that runs off along the contradiction and so proves it.
  table.push_back({.method = spg, .why = "looks for a contradiction", .iterations = warm_iterations});
  return table;
}

// Nothing factored. The accelerated method is the steadier one on hyperstatic contacts, the spectral one on
// joints; under coulomb the first gets what slides settled, and the second goes on where it leaves off.
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
  // A deadline that falls into the factorisations leaves the caller with nothing but the start.
  const bool hurried = options.deadline < factored_cost * static_cast<double>(problem.K.blocks());
  // Without friction the laws are one, and the convex tables hold.
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
  // A caller with limits of his own gets what they allow: rows without limits of theirs follow, since to stop
  // short of both the tolerance and the caller's limits would waste what he is ready to spend.
  if (options.max_iterations > 0 || std::isfinite(options.deadline)) {
    if (coulomb && !function && !too_many && !hurried)
      add_frozen_path(choice.table, 2 * path_iterations, nullptr);
    choice.table.push_back({.method = coulomb ? apgd : spg, .why = "what the limits of the caller allow"});
  }
  return choice;
}

// One group of islands.
Solution solve_one(const Problem& problem, const Options& options) {
  const Choice choice = choose(problem, options);
  Solution s = run_phases(problem, options, choice.table);
  s.reason = choice.why + ": " + describe(s.phases);
  return s;
}

// One group of islands after the direct way has failed: from nothing, as its best x may lie where Coulomb's
// law has no solution nearby.
Solution solve_whole(const Problem& problem, const Options& options) {
  const Table table{
      {.method = central_path, .why = "another way from the start", .iterations = 2 * path_iterations},
      {.method = apgd, .why = "another way from the start", .iterations = 1000, .from = From::start},
      {.method = newton, .why = "finds the faces", .iterations = 8}};
  return run_phases(problem, options, table);
}

// And from the best x of both, where that is not far.
Solution solve_last(const Problem& problem, const Options& options) {
  return run_phases(problem, options,
                    {{.method = apgd, .why = "goes on from the best", .iterations = 5000},
                     {.method = spg, .why = "goes on from the best", .iterations = 2000}});
}

// A start that fulfils the tolerance is the solution, as it is for every method.
bool accepts_start(const Problem& problem, const Options& options, Solution& s) {
  if (options.x0.empty() || options.history || options.callback) return false;
  s.x.assign(options.x0.begin(), options.x0.end());
  project(problem.K, s.x, s.x);
  measure(problem, options.law, s);
  if (!(s.residual <= options.tolerance)) return false;
  s.products = 1;
  s.status = Status::converged;
  s.method = "elimination";
  s.phases = {{s.method, "the start is a solution", 0, s.residual}};
  s.reason = describe(s.phases);
  return true;
}

// The one with the smaller residual; counts and phases are those of both.
Solution better_of(Solution first, Solution second) {
  if (first.phases.empty()) first.phases = {{first.method, eliminated, first.iterations, first.residual}};
  first.phases.insert(first.phases.end(), second.phases.begin(), second.phases.end());
  second.iterations += first.iterations;
  second.products += first.products;
  second.factorizations += first.factorizations;
  second.time += first.time;
  if (first.residual < second.residual) {
    second.x = std::move(first.x);
    second.u = std::move(first.u);
    second.residual = first.residual;
    second.objective = first.objective;
    second.method = first.method;
  }
  second.phases = std::move(first.phases);
  second.reason = describe(second.phases);
  return second;
}

}  // namespace

Solution automatic(const Problem& problem, const Options& options) {
  if (Solution s; accepts_start(problem, options, s)) return s;
  Elimination elimination;
  Solution s = automatic(problem, options, elimination, {});
  if (s.reason.empty()) {
    s.phases = {{s.method, eliminated, s.iterations, s.residual}};
    s.reason = describe(s.phases);
  }
  return s;
}

// Mechanisms with few contacts, and few contacts alone, are solved directly, all islands at once. What does
// not lead to a solution there has another chance on the whole; the work stays bounded, as a robot that jams
// should not stop the clock.
Solution automatic(const Problem& problem, const Options& options, Elimination& elimination,
                   Solution memory) {
  constexpr double near = 100;  // times the tolerance
  Solution s = std::move(memory);
  if (!elimination.solve(problem, options, s)) {
    s = solve_by_islands(problem, options, solve_one);
    if (s.status == Status::converged || s.status == Status::infeasible) return s;
    // Joints converge last; where the solve ends before, they hold all the same.
    if (!elimination.complete(problem, options, s)) return s;
    s.phases.push_back({"elimination", "joints for the contacts so far", 0, s.residual});
    s.reason += ", " + describe({s.phases.back()});
    return s;
  }
  Options rest = options;
  for (Method method : {solve_whole, solve_last}) {
    rest.deadline = options.deadline - s.time;
    if (s.status == Status::converged || s.status == Status::infeasible || !(rest.deadline > 0)) break;
    if (options.max_iterations && s.iterations >= options.max_iterations) break;
    if (options.max_iterations) rest.max_iterations = options.max_iterations - s.iterations;
    const bool last = method == Method{solve_last};
    if (last && !(s.residual <= near * options.tolerance)) break;
    const std::vector<double> best = last ? s.x : std::vector<double>();
    rest.x0 = best;
    s = better_of(std::move(s), solve_by_islands(problem, rest, method));
  }
  return s;
}

}  // namespace amontons
