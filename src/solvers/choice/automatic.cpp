// method = "auto": which methods race (race.hpp), what an iteration of each costs, and what is expected of
// each before it has run. The expectations are medians over the tuning half of benchmarks/corpus.py; they
// matter until a method shows its rate, and for those that factor until they are used up.
//
// Three facts about the methods make the field:
//
//   - First-order iterations cost a pass over the contacts, some 10 ns for each, and soon know which of them
//     slide; their count grows with the condition, so that stresses in high or hyperstatic stacks, chains of
//     joints and mass ratios take tens of thousands. Of the two now one is faster, now the other.
//   - A step with a factorisation costs some fifty of those, more where bodies fill their factor up, but the
//     condition hardly matters to it: the interior point takes ten to twenty, Newton's method near a
//     solution a few.
//   - Under coulomb no method is proven to converge: several ways to a solution are worth more than one way
//     gone far.
#include "amontons/solvers/choice/automatic.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "amontons/base/patience.hpp"
#include "amontons/solvers/choice/islands.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/first_order/apgd.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/krylov/cg.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "amontons/solvers/second_order/interior_point.hpp"
#include "amontons/solvers/second_order/newton.hpp"
#include "solvers/choice/direct_way.hpp"
#include "solvers/choice/frozen_path.hpp"
#include "solvers/choice/race.hpp"
#include "solvers/direct/constrained.hpp"

namespace amontons {

namespace {

// Unknowns of a factorisation that is not even thought of: the analysis of a matrix of so many rows takes
// seconds, and if it is dense 200 MB; bodies meet a few others each.
constexpr std::size_t most_rows = 5000, most_bodies = 50000;
// Bodies that fill so little that their number tells the cost of a factorisation.
constexpr std::size_t few_bodies = 64;
// Products to the tolerance of the first-order method that is the likelier one, and of conjugate gradients.
constexpr double ahead = 30, linear_ahead = 8;
// Of a race without limits of the caller: nominal ns, and more per block. What is not solved by then creeps.
// Where work is not limited (Patience, as in a step), so many times that: whoever solves one problem waits
// for the method that gets there.
constexpr double least_work = 4e8, work_per_block = 1.5e5, patience_alone = 4;
// After the direct way has failed, which is seldom then: most have no solution, and the race is to prove it.
// Where work is limited (Patience, as in a step), no more than what others may still find.
constexpr double least_work_after = 8e6, work_per_block_after = 5e4;
constexpr double least_work_in_step = 1e6, work_per_block_in_step = 4e4;

// Why the direct way was taken.
constexpr const char* eliminated = "bilateral rows are eliminated, islands are small";

// Nominal costs in ns, least squares on the times of the corpus.
struct Costs {
  // A product fused with the passes of a first-order method; one by itself; the mean of one and of a solve
  // with the factor.
  double fused, plain, solve;
  FactorCost factor;
};

// What a factorisation takes beside its multiplications: blocks are scaled and assembled, and the method's
// own work on the cones is counted with it.
double assembly(const Problem& problem) {
  const auto contacts = static_cast<double>(problem.K.contacts());
  const auto rest = static_cast<double>(problem.K.blocks()) - contacts;
  const auto bodies = static_cast<double>(problem.graph.bodies());
  return 500 + 90 * bodies + 450 * contacts + 200 * rest;
}

double analysed(const Problem& problem) {
  constexpr double per_multiplication = 0.25;
  return assembly(problem) + per_multiplication * ShiftedSystem(problem).factor_work();
}

Costs costs_of(const Problem& problem) {
  const auto contacts = static_cast<double>(problem.K.contacts());
  const auto rest = static_cast<double>(problem.rows()) - 3 * contacts;
  const auto rows = static_cast<double>(problem.rows());
  Costs c;
  if (const auto* A = std::get_if<ContactSystem>(&problem.A)) {
    // Contacts that are given as rows of D, as files have them, are three times the memory; plain loops go
    // row by row, in the product by itself, too.
    const bool stored = A->contacts.empty(), fused = ContactIterate::fits(problem);
    const auto cost = [&](double per_contact) {
      return 160 + per_contact * contacts + 5 * std::max(0.0, rest);
    };
    c.fused = cost(!fused ? 44 : stored ? 13 : 9);
    c.plain = stored ? cost(46) : 2.5 * c.fused;
    c.solve = 12 * c.fused;
    c.factor = {assembly(problem), problem.graph.bodies() > few_bodies ? analysed : nullptr};
    return c;
  }
  double entries = rows * rows;
  if (const auto* A = std::get_if<SparseOperator>(&problem.A)) entries = static_cast<double>(A->data.size());
  c.fused = 100 + entries + 10 * rows;
  c.plain = c.solve = c.fused;
  c.factor = {assembly(problem) + 3 * entries, analysed};
  return c;
}

bool can_factor(const Problem& problem) {
  if (std::holds_alternative<CallbackOperator>(problem.A)) return false;
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  return system ? system->bodies.size() <= most_bodies : problem.rows() <= most_rows;
}

using From = Contender::From;
using Field = std::vector<Contender>;

// K = R^m: nothing slides or opens, the problem is a linear system.
Field linear_field(const Costs& c, bool factored) {
  Field field{
      {.start = start_cg,
       .why = "a linear system",
       .product = c.fused,
       .products = linear_ahead,
       .first_turn = 8},
      // Contradictory rows end here, in a method that runs off along the contradiction and so proves it.
      {.start = start_spg,
       .why = "looks for a contradiction",
       .product = c.fused,
       .products = 5000,
       .first_turn = 16,
       .from = From::start,
       .limit = 200}};
  if (factored)
    field.push_back({.start = start_factored_cg,
                     .why = "one factorisation",
                     .product = c.plain,
                     .products = 6,
                     .factorizations = 2.5});  // the analysis is worth more than one
  return field;
}

// What needs products alone. The accelerated method is ahead where contacts are many, five times in the mean
// over hundreds of them; the spectral one on few, and on joints. The one behind starts when the other slows
// down, on large problems more than on small ones.
//
// Both leave joints to a factorisation where they can: iterations are then those of contacts.
void add_first_order(Field& field, const Problem& problem, const Costs& c, std::size_t held, double size) {
  constexpr std::size_t many_contacts = 30;
  const double behind = 100 * size;
  constexpr double per_held_body = 300;  // ns
  const bool accelerated = problem.K.contacts() >= many_contacts;
  const double product = c.fused + per_held_body * static_cast<double>(held);
  field.push_back({.start = start_spg,
                   .why = held ? "cheap iterations, joints eliminated" : "cheap iterations",
                   .product = product,
                   .products = accelerated ? behind : ahead,
                   .first_turn = 16,
                   .constrained = held > 0});
  field.push_back(
      {.start = start_apgd,
       .why = held ? "cheap iterations, accelerated, joints eliminated" : "cheap iterations, accelerated",
       .product = product,
       .products = accelerated ? ahead : behind,
       .first_turn = 16,
       .constrained = held > 0});
}

// What factors. Newton's method is a gamble of one factorisation, and the more blocks the more of them have
// to lie on the right face for it to pay; it starts again when the others have come nearer. The interior
// point is sure of its way under the associated law, and followed by its crossover to the last digits.
void add_factoring(Field& field, const Costs& c, bool coulomb, bool warm, double digits, double size) {
  // A start that is nearly a solution lies at the border of the cones, where a central path does not begin.
  const double central = warm ? 4 + 1.4 * digits : 4.5 + 0.8 * digits;
  // Under coulomb each factorisation takes longer, without symmetry, and where contacts are many the path may
  // lose its middle; with the term held it goes on, slowly.
  const double bent = 1.7 * central * (0.6 + 0.4 * size);
  const double frozen = (warm ? 6 + 4 * digits : 4 + 2.2 * digits) * (0.9 + 0.3 * size);
  field.push_back({.start = start_newton_steps,
                   .why = "finds the faces",
                   .product = coulomb ? c.solve : c.plain,
                   .products = (coulomb ? 20 * digits : 10) * size,
                   .factorizations = (1 + (coulomb ? 0.6 : 0.25) * digits) * size,
                   .restarts = 6});
  field.push_back({.start = start_central_path,
                   .why = "factors in every iteration",
                   .factorizations = coulomb ? bent : central});
  field.push_back({.start = start_newton,
                   .why = "finds the faces that hold the path back",
                   .product = c.plain,
                   .products = coulomb ? 40 * digits : 10,
                   .factorizations = 4,
                   .from = From::previous,
                   .limit = coulomb ? 12U : 30U});
  if (coulomb)
    field.push_back({.start = start_path_of_frozen_terms,
                     .why = "factors in every iteration, the De Saxce term held",
                     .factorizations = frozen});
}

// Under coulomb no method is sure.
void add_other_ways(Field& field, const Costs& c, double digits) {
  field.push_back({.start = start_frozen_path,
                   .why = "finds the stresses for the friction directions so far",
                   .product = c.fused,
                   .products = 300,
                   .factorizations = 15 + 4 * digits});
}

// Inequalities or friction.
Field field_of(const Problem& problem, const Options& options, const Costs& c, std::size_t held) {
  // Blocks over which the expectations of what must find all faces at once grow.
  constexpr double blocks_unit = 300;
  const double digits = std::clamp(-std::log10(options.tolerance), 1.0, 16.0);
  const double size = 1 + static_cast<double>(problem.K.blocks()) / blocks_unit;
  const bool coulomb = options.law == Law::coulomb && problem.K.has_friction();
  Field field;
  add_first_order(field, problem, c, held, size);
  if (!can_factor(problem)) return field;
  add_factoring(field, c, coulomb, !options.x0.empty(), digits, size);
  if (coulomb) add_other_ways(field, c, digits);
  return field;
}

// With elimination, where islands are small enough for it: it takes about the same time at every tolerance,
// and first-order iterations, begun beside it, are done earlier where few of them lead to a loose one.
Field field_with(const Problem& problem, const Options& options, const Costs& c, double direct) {
  Field field = problem.K.all_free() ? linear_field(c, false) : field_of(problem, options, c, 0);
  field.push_back({.start = start_elimination, .why = eliminated, .product = direct, .products = 1});
  return field;
}

// What the problem says before anything has run; empty for the common case.
const char* remark(const Problem& problem) {
  if (problem.K.all_free()) return "all rows are bilateral, a linear system: ";
  if (std::holds_alternative<CallbackOperator>(problem.A))
    return "A is a function, which cannot be factored: ";
  return can_factor(problem) ? "" : "A is too large to factor: ";
}

Solution race_for(const Problem& problem, const Options& options, double work) {
  const Costs costs = costs_of(problem);
  ConstrainedProblem rest;
  const bool watched = options.history || options.callback;
  const bool held = !problem.K.all_free() && !watched && rest.make(problem, options.law);
  const Field field = problem.K.all_free() ? linear_field(costs, can_factor(problem))
                                           : field_of(problem, options, costs, held ? rest.bodies() : 0);
  Solution s = race(problem, options, field, costs.factor, work, held ? &rest : nullptr);
  s.reason = remark(problem) + s.reason;
  return s;
}

bool is_in_step() { return Patience::work_left() < Patience::infinite_work; }

double most_work(const Problem& problem) {
  const double work = least_work + work_per_block * static_cast<double>(problem.K.blocks());
  return is_in_step() ? work : patience_alone * work;
}

// One group of islands.
Solution solve_one(const Problem& problem, const Options& options) {
  return race_for(problem, options, most_work(problem));
}

// One group of islands after the direct way has failed.
Solution solve_after_elimination(const Problem& problem, const Options& options) {
  const auto blocks = static_cast<double>(problem.K.blocks());
  return race_for(problem, options,
                  is_in_step() ? least_work_in_step + work_per_block_in_step * blocks
                               : least_work_after + work_per_block_after * blocks);
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

// What elimination alone did, in words.
void name_elimination(Solution& s) {
  s.phases = {{s.method, eliminated, s.iterations, s.residual}};
  s.reason = describe(s.phases);
}

// The one with the smaller residual; counts and phases are those of both.
Solution better_of(Solution first, Solution second) {
  if (first.phases.empty()) first.phases = {{first.method, eliminated, first.iterations, first.residual}};
  first.phases.insert(first.phases.end(), second.phases.begin(), second.phases.end());
  add_counts(second, first);
  second.time += first.time;
  second.phases = std::move(first.phases);
  take_better(second, std::move(first));
  second.reason = describe(second.phases);
  return second;
}

// One group of islands of a problem of which another one has too many rows for the direct way: where this
// one has few, it goes that way.
Solution solve_directly_or_race(const Problem& problem, const Options& options) {
  Elimination elimination;
  Solution s;
  if (!elimination.solve(problem, options, s)) return solve_one(problem, options);
  name_elimination(s);
  return s.status == Status::converged ? s
                                       : better_of(std::move(s), solve_after_elimination(problem, options));
}

// The whole once more after the direct way has failed, from nothing, as its best x may lie where Coulomb's law
// has no solution nearby. The work stays bounded, as a robot that jams should not stop the clock.
Solution after_elimination(const Problem& problem, const Options& options, const Elimination& elimination,
                           Solution s) {
  Options rest = options;
  rest.x0 = {};
  rest.deadline = options.deadline - s.time;
  if (s.status != Status::stalled || !elimination.fell_short() || !(rest.deadline > 0)) return s;
  if (options.max_iterations) {
    if (s.iterations >= options.max_iterations) return s;
    rest.max_iterations = options.max_iterations - s.iterations;
  }
  return better_of(std::move(s), solve_by_islands(problem, rest, solve_after_elimination));
}

}  // namespace

// A problem by itself, where nothing is known of a step before it: elimination races too, unless it is the
// favourite from the first; islands have what the tolerance of the whole leaves them.
Solution automatic(const Problem& problem, const Options& options) {
  if (Solution s; accepts_start(problem, options, s)) return s;
  const double direct = elimination_cost(problem, options);
  // A linear system too large to be a contender's: conjugate gradients before a factorisation.
  if (problem.K.all_free() && !std::isfinite(direct)) {
    Solution s = solve_one(problem, options);
    if (s.status != Status::stalled) return s;
  }
  if (std::isfinite(direct)) {
    const Costs costs = costs_of(problem);
    if (direct > (problem.K.all_free() ? linear_ahead : ahead) * costs.fused) {
      Solution s = race(problem, options, field_with(problem, options, costs, direct), costs.factor,
                        most_work(problem));
      if (s.status != Status::stalled || s.factorizations > 0) return s;
    }
  }
  Elimination elimination;
  Solution s;
  if (!solve_directly(problem, options, elimination, s))
    s = solve_by_islands(problem, options, solve_directly_or_race, ToleranceOf::whole);
  if (s.reason.empty()) name_elimination(s);
  return s;
}

// Mechanisms with few contacts, and few contacts alone, all islands at once: a step of a simulation has the
// memory, the analysis and nearly the solution of the one before.
bool solve_directly(const Problem& problem, const Options& options, Elimination& elimination, Solution& s) {
  if (!elimination.solve(problem, options, s)) return false;
  s = after_elimination(problem, options, elimination, std::move(s));
  return true;
}

Solution solve_by_race(const Problem& problem, const Options& options) {
  return solve_by_islands(problem, options, solve_directly_or_race, ToleranceOf::each);
}

// A step of a simulation.
Solution automatic(const Problem& problem, const Options& options, Elimination& elimination,
                   Solution memory) {
  Solution s = std::move(memory);
  if (!solve_directly(problem, options, elimination, s)) s = solve_by_race(problem, options);
  return s;
}

}  // namespace amontons
