// method = "auto": the direct way if islands are small; otherwise a race (race.hpp) of the methods below.
// policy.hpp holds the cost of an iteration of each method and the expected number of iterations.
//
// Three facts about the methods determine the choice of contenders:
//
//   - A first-order iteration costs one pass over the contacts, about 10 ns each, and soon finds which of
//     them slide. The number of iterations grows with the condition. Stresses in high or hyperstatic stacks,
//     chains of joints and mass ratios take tens of thousands. Neither of the two methods is always faster.
//   - A step with a factorisation costs some fifty passes, more if the factor has much fill. It hardly
//     depends on the condition: the interior point takes ten to twenty steps, Newton's method near a solution
//     a few.
//   - Under coulomb no method is proven to converge. Several methods succeed more often than one method given
//     more time.
#include "amontons/solvers/choice/automatic.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "amontons/base/elementary.hpp"
#include "amontons/solvers/choice/islands.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/first_order/apgd.hpp"
#include "amontons/solvers/first_order/contact_iterate.hpp"
#include "amontons/solvers/first_order/forwarded_iterate.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/krylov/cg.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "amontons/solvers/second_order/interior_point.hpp"
#include "amontons/solvers/second_order/newton.hpp"
#include "solvers/choice/frozen_path.hpp"
#include "solvers/choice/policy.hpp"
#include "solvers/choice/race.hpp"
#include "solvers/direct/constrained.hpp"

namespace amontons {

namespace {

// The reason reported for the direct way.
constexpr const char* eliminated = "bilateral rows are eliminated, islands are small";

// Nominal costs in ns.
struct Costs {
  // fused: a product fused with the passes of a first-order method. plain: a product alone. solve: the mean
  // of a product and a solve with the factor.
  double fused, plain, solve;
  FactorCost factor;
};

// Cost of a factorisation without its multiplications.
double assembly(const Problem& problem) {
  return choice::policy.factor_per_body * static_cast<double>(problem.graph.bodies()) +
         choice::policy.factor_per_block * static_cast<double>(problem.K.blocks());
}

double analysed(const Problem& problem) {
  return assembly(problem) + choice::policy.factor_per_multiplication * ShiftedSystem(problem).factor_work();
}

Costs costs_of(const Problem& problem) {
  const auto rows = static_cast<double>(problem.rows());
  Costs c;
  if (std::holds_alternative<ContactSystem>(problem.A)) {
    const auto contacts = static_cast<double>(problem.K.contacts());
    const bool fused = ContactIterate::fits(problem);
    c.fused = (fused ? choice::policy.product_per_contact : choice::policy.plain_per_contact) * contacts +
              choice::policy.product_per_row * std::max(0.0, rows - 3 * contacts);
    c.plain = choice::policy.unfused * c.fused;
    c.solve = choice::policy.factor_solve * c.fused;
    c.factor = {assembly(problem), problem.graph.bodies() > choice::policy.small_island ? analysed : nullptr};
    return c;
  }
  double entries = rows * rows;
  if (const auto* A = std::get_if<SparseOperator>(&problem.A)) entries = static_cast<double>(A->data.size());
  c.fused = c.plain = c.solve = entries + choice::policy.product_per_row * rows;
  c.factor = {assembly(problem) + 3 * entries, analysed};
  return c;
}

bool can_factor(const Problem& problem) {
  if (std::holds_alternative<CallbackOperator>(problem.A)) return false;
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  if (has_trees(problem)) return false;
  return system ? system->bodies.size() <= choice::policy.most_bodies
                : problem.rows() <= choice::policy.most_rows;
}

using From = Contender::From;
using Field = std::vector<Contender>;

// K = R^m: nothing slides or opens. The problem is a linear system.
Field linear_field(const Costs& c, bool factored) {
  Field field{
      {.start = start_cg,
       .why = "a linear system",
       .product = c.fused,
       .products = choice::policy.linear_products,
       .first_turn = choice::policy.first_turn},
      // For contradictory rows: a method whose iterates diverge along the contradiction and so prove it.
      {.start = start_spg,
       .why = "looks for a contradiction",
       .product = c.fused,
       .products = choice::policy.contradiction_products,
       .first_turn = choice::policy.first_turn,
       .from = From::start,
       .limit = choice::policy.contradiction_iterations}};
  if (factored)
    field.push_back({.start = start_factored_cg,
                     .why = "one factorisation",
                     .product = c.plain,
                     .products = choice::policy.linear_products,
                     .factorizations = choice::policy.preconditioned_factorizations});
  return field;
}

// Methods that need only products. The less likely one starts when the other slows down, on large problems
// later than on small ones. A factorisation eliminates the joints if possible: iterations are then those of
// contacts.
void add_first_order(Field& field, const Problem& problem, const Costs& c, std::size_t held, double size) {
  const bool accelerated = problem.K.contacts() >= choice::policy.many_contacts;
  const double behind = choice::policy.unlikelier_products * size;
  const double product = c.fused + choice::policy.product_per_held_body * static_cast<double>(held);
  field.push_back({.start = start_spg,
                   .why = held ? "cheap iterations, joints eliminated" : "cheap iterations",
                   .product = product,
                   .products = accelerated ? behind : choice::policy.likelier_products,
                   .first_turn = choice::policy.first_turn,
                   .constrained = held > 0});
  field.push_back(
      {.start = start_apgd,
       .why = held ? "cheap iterations, accelerated, joints eliminated" : "cheap iterations, accelerated",
       .product = product,
       .products = accelerated ? choice::policy.likelier_products : behind,
       .first_turn = choice::policy.first_turn,
       .constrained = held > 0});
}

// Methods that factor. The interior point converges under the associated law. Under coulomb its matrices are
// unsymmetric, and with many contacts the path may leave the middle of the cones. Newton's method continues
// where the path stops, and finds the faces that stop it.
void add_factoring(Field& field, const Costs& c, bool coulomb, double digits, double size) {
  const double straight = choice::policy.path_start + choice::policy.path_per_digit * digits;
  const double path = coulomb ? choice::policy.path_unsymmetric * size * straight : straight;
  field.push_back({.start = start_central_path, .why = "factors in every iteration", .factorizations = path});
  field.push_back({.start = start_newton,
                   .why = "finds the faces that hold the path back",
                   .product = c.plain,
                   .factorizations = choice::policy.path_start,
                   .from = From::previous,
                   .limit = choice::policy.newton_iterations});
  if (coulomb)
    field.push_back({.start = start_frozen_path,
                     .why = "finds the stresses for the friction directions so far",
                     .product = c.fused,
                     .factorizations = choice::policy.frozen_ratio * straight});
}

// Contenders for problems with inequalities or friction.
Field field_of(const Problem& problem, const Options& options, const Costs& c, std::size_t held) {
  constexpr double most_digits = 16;  // not tuned: those of double precision
  const double digits = std::clamp(-elementary::log10(options.tolerance), 1.0, most_digits);
  const double size = 1 + static_cast<double>(problem.K.blocks()) / choice::policy.blocks_unit;
  const bool coulomb = law_of(problem, options) == Law::coulomb && problem.K.has_friction();
  Field field;
  add_first_order(field, problem, c, held, size);
  if (can_factor(problem)) add_factoring(field, c, coulomb, digits, size);
  return field;
}

// A remark on the problem before any method has run; empty for the common case.
const char* remark(const Problem& problem) {
  if (problem.K.all_bilateral()) return "all rows are bilateral, a linear system: ";
  if (std::holds_alternative<CallbackOperator>(problem.A))
    return "A is a function, which cannot be factored: ";
  return can_factor(problem) ? "" : "A is too large to factor: ";
}

// Nominal work (ns) at which a race ends if the caller sets no limit: as a rule, and after the direct way.
struct RaceWork {
  double alone, per_block;
};
RaceWork usual() { return {choice::policy.race_work, choice::policy.race_work_per_block}; }
RaceWork late() { return {choice::policy.late_race_work, choice::policy.late_race_work_per_block}; }

Solution race_for(const Problem& problem, const Options& options, Budget& budget, RaceWork limit) {
  if (has_trees(problem) && problem.rows() <= choice::policy.most_rows)
    return race_for(as_matrix(problem), options, budget, limit);
  const Costs costs = costs_of(problem);
  ConstrainedProblem rest;
  const bool watched = options.history || options.callback;
  const bool held = !problem.K.all_bilateral() && !watched && rest.make(problem, law_of(problem, options));
  Options here = options;  // the device does not serve this problem, and no part of it
  here.iterates = nullptr;
  const Field field = problem.K.all_bilateral() ? linear_field(costs, can_factor(problem))
                                                : field_of(problem, options, costs, held ? rest.bodies() : 0);
  const double work = limit.alone + limit.per_block * static_cast<double>(problem.K.blocks());
  Solution s = race(problem, here, budget, field, costs.factor, work, held ? &rest : nullptr);
  s.reason = remark(problem) + s.reason;
  return s;
}

// A contender of a field in fixed order. It has no expected cost by which another could be preferred: the
// race takes the first of such contenders that has not run. Its only turn lasts until it ends. Each starts
// from the best x so far.
Contender in_order(Starter start, const char* why, std::size_t limit = 0) {
  constexpr auto to_the_end = std::numeric_limits<std::size_t>::max();
  return {.start = start, .why = why, .first_turn = to_the_end, .limit = limit};
}

// A device has the passes of two methods. All islands are one problem there, and rows of joints stay in it,
// because many contacts use the device best. A method that stalls passes its best x to the other.
Solution solve_on_device(const Problem& problem, const Options& options, Budget& budget) {
  Field field{in_order(start_spg, "on the device"), in_order(start_apgd, "accelerated, on the device")};
  if (problem.K.contacts() >= choice::policy.many_contacts) std::swap(field[0], field[1]);
  Solution s = race(problem, options, budget, field, {}, Budget::unlimited);
  s.device = device_of(problem, options);
  return s;
}

// A start that meets the tolerance is the solution, as for every method.
bool accepts_start(const Problem& problem, const Options& options, Solution& s) {
  if (options.x0.empty() || options.history || options.callback) return false;
  s.x.assign(options.x0.begin(), options.x0.end());
  project(problem.K, s.x, s.x);
  measure(problem, law_of(problem, options), s);
  if (!(s.residual <= options.tolerance)) return false;
  s.products = 1;
  s.status = Status::converged;
  s.method = "elimination";
  s.phases = {{s.method, "the start is a solution", 0, s.residual}};
  s.reason = describe(s.phases);
  return true;
}

// Names what elimination alone did, where nothing else ran.
void name_elimination(Solution& s) {
  if (!s.reason.empty()) return;
  s.phases = {{s.method, eliminated, s.iterations, s.residual}};
  s.reason = describe(s.phases);
}

// One group of islands if another one has too many rows for the direct way.
Solution solve_directly_or_race(const Problem& problem, const Options& options, Budget& budget) {
  Elimination elimination;
  Solution s;
  if (!solve_directly(problem, options, budget, elimination, s))
    return race_for(problem, options, budget, usual());
  name_elimination(s);
  return s;
}

// Solves the whole problem once more after the direct way has failed. It starts from zero, because near the
// best x Coulomb's law may have no solution. The work is bounded, so that a jammed robot does not stop a
// simulation.
Solution after_elimination(const Problem& problem, const Options& options, Budget& budget,
                           const Elimination& elimination, Solution s) {
  Options rest = options;
  rest.x0 = {};
  if (s.status != Status::stalled || !elimination.fell_short() || budget.late()) return s;
  if (options.max_iterations) {
    if (s.iterations >= options.max_iterations) return s;
    rest.max_iterations = options.max_iterations - s.iterations;
  }
  Solution second = solve_by_islands(
      problem, rest, budget,
      [](const Problem& p, const Options& o, Budget& share) { return race_for(p, o, share, late()); });
  name_elimination(s);
  s.status = second.status;
  join(s, std::move(second));
  s.reason = describe(s.phases);
  return s;
}

}  // namespace

// Contacts between two faces (sliding and sticking, open and closed) stop the central path at a distance of
// sqrt(eps) from the solution. From there the semismooth Newton method identifies the faces and converges to
// the last digits. If it fails, P-SPG-FB continues.
Solution interior_point(const Problem& problem, const Options& options, Budget& budget) {
  constexpr const char* faces = "finds the faces that hold the path back";
  Field field{in_order(start_central_path, "follows the central path"),
              in_order(start_newton, faces, choice::policy.newton_iterations)};
  if (law_of(problem, options) == Law::coulomb && problem.K.has_friction()) {
    field.push_back(
        in_order(start_path_of_frozen_terms, "another path, the De Saxce term held in each step"));
    field.push_back(in_order(start_newton, faces, choice::policy.newton_iterations));
  }
  field.push_back(in_order(start_spg, "takes the last digits", choice::policy.last_iterations));
  return race(problem, options, budget, field, {}, Budget::unlimited);
}

// A single problem.
Solution automatic(const Problem& problem, const Options& options, Budget& budget) {
  if (on_device(problem, options)) return solve_on_device(problem, options, budget);
  if (Solution s; accepts_start(problem, options, s)) return s;
  // A large linear system: conjugate gradients are tried before a factorisation.
  if (problem.K.all_bilateral() && problem.rows() > choice::policy.large_linear_system) {
    Solution s = race_for(problem, options, budget, usual());
    if (s.status != Status::stalled) return s;
  }
  Elimination elimination;
  Solution s;
  if (!solve_directly(problem, options, budget, elimination, s))
    s = solve_by_islands(problem, options, budget, solve_directly_or_race);
  name_elimination(s);
  return s;
}

// Mechanisms with few contacts, and few contacts alone: all islands at once. A step of a simulation reuses
// the memory, the analysis and nearly the solution of the last step.
bool solve_directly(const Problem& problem, const Options& options, Budget& budget, Elimination& elimination,
                    Solution& s) {
  if (on_device(problem, options)) return false;
  if (!elimination.solve(problem, options, budget, s)) return false;
  s = after_elimination(problem, options, budget, elimination, std::move(s));
  return true;
}

Solution solve_by_race(const Problem& problem, const Options& options, Budget& budget) {
  if (on_device(problem, options)) return solve_on_device(problem, options, budget);
  return solve_by_islands(problem, options, budget, solve_directly_or_race);
}

// A step of a simulation.
Solution automatic(const Problem& problem, const Options& options, Budget& budget, Elimination& elimination,
                   Solution memory) {
  Solution s = std::move(memory);
  if (!solve_directly(problem, options, budget, elimination, s)) s = solve_by_race(problem, options, budget);
  return s;
}

}  // namespace amontons
