// method = "auto": the direct way if islands are small; otherwise the methods below in a fixed order
// (order.hpp), from cheap iterations to many factorisations.
//
// Three facts about the methods determine the order:
//
//   - A first-order iteration costs one pass over the contacts, about 10 ns each, and soon finds which of
//     them slide. The number of iterations grows with the condition. Stresses in high or hyperstatic stacks,
//     chains of joints and mass ratios take tens of thousands. One such method is enough: p-spg-fb beside
//     apgd made solves no shorter on any set of problems (docs/decisions/auto.md).
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

#include "amontons/solvers/choice/islands.hpp"
#include "amontons/solvers/direct/elimination.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/phases.hpp"
#include "amontons/solvers/driver/start.hpp"
#include "amontons/solvers/first_order/apgd.hpp"
#include "amontons/solvers/first_order/forwarded_iterate.hpp"
#include "amontons/solvers/first_order/spg.hpp"
#include "amontons/solvers/krylov/cg.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "amontons/solvers/second_order/interior_point.hpp"
#include "amontons/solvers/second_order/newton.hpp"
#include "solvers/choice/order.hpp"
#include "solvers/choice/policy.hpp"
#include "solvers/direct/constrained.hpp"
#include "solvers/second_order/frozen_path.hpp"

namespace amontons {

namespace {

// The reason reported for the direct way.
constexpr const char* eliminated = "bilateral rows are eliminated, islands are small";

bool can_factor(const Problem& problem) {
  if (std::holds_alternative<CallbackOperator>(problem.A)) return false;
  const auto* system = std::get_if<ContactSystem>(&problem.A);
  return system ? system->bodies.size() <= choice::policy.most_bodies
                : problem.rows() <= choice::policy.most_rows;
}

using Field = std::vector<Ordered>;

// K = R^m: nothing slides or opens. The problem is a linear system, and cg ends in at most as many steps as A
// has different eigenvalues. With one factorisation of A + shift P as its preconditioner it takes a few steps
// on any chain of joints. Both prove a contradiction of the rows.
Field linear_field(const Problem& problem) {
  Field field{{.start = start_cg, .why = "a linear system"}};
  if (can_factor(problem))
    field.push_back({.start = start_factored_cg,
                     .why = "one factorisation",
                     .factorizations = choice::policy.path_factorizations});
  return field;
}

// The method that needs only products. A factorisation eliminates the joints if possible (held): iterations
// are then those of contacts, whose number does not grow with the length of a chain of joints.
Field first_order(bool held) {
  return {{.start = start_apgd, .why = held ? "cheap iterations, joints eliminated" : "cheap iterations"}};
}

// Methods that factor. The interior point converges under the associated law. Under coulomb its matrices are
// unsymmetric, twice the work of symmetric ones. Newton's method continues where the path stops, and finds
// the faces that stop it. The frozen path takes at least two paths of symmetric matrices. With many contacts
// the path of coulomb has many folds, and the frozen one comes first.
void add_factoring(Field& field, bool coulomb, std::size_t blocks) {
  const double path = choice::policy.path_factorizations, of_law = coulomb ? 2 * path : path;
  Field of_path{{.start = start_central_path, .why = "factors in every iteration", .factorizations = of_law},
                {.start = start_newton,
                 .why = "finds the faces that hold the path back",
                 .limit = choice::policy.first_turn,
                 .factorizations = path,
                 .from_the_end = true}};
  if (coulomb)
    of_path.insert(blocks > choice::policy.many_blocks ? of_path.begin() : of_path.end(),
                   {.start = start_frozen_path,
                    .why = "finds the stresses for the friction directions so far",
                    .factorizations = of_law});
  field.insert(field.end(), of_path.begin(), of_path.end());
}

// A remark on the problem before any method has run; empty for the common case.
const char* remark(const Problem& problem) {
  if (problem.K.all_bilateral()) return "all rows are bilateral, a linear system: ";
  if (std::holds_alternative<CallbackOperator>(problem.A))
    return "A is a function, which cannot be factored: ";
  return can_factor(problem) ? "" : "A is too large to factor: ";
}

// Methods in the order of their costs.
Solution solve_in_order(const Problem& problem, const Options& options, Budget& budget) {
  const Law law = law_of(problem, options);
  const bool linear = problem.K.all_bilateral(), watched = options.history || options.callback;
  ConstrainedProblem rest;
  const bool held = !linear && !watched && rest.make(problem, law);
  Field field = linear ? linear_field(problem) : first_order(held);
  if (!linear && can_factor(problem))
    add_factoring(field, law == Law::coulomb && problem.K.has_friction(), problem.K.blocks());
  Options here = options;  // the device does not serve this problem, and no part of it
  here.iterates = nullptr;
  Solution s = in_order(problem, here, budget, field, held ? &rest : nullptr);
  s.reason = remark(problem) + s.reason;
  return s;
}

// A device has the passes of two methods and cannot factor. All islands are one problem there, and rows of
// joints stay in it, because many contacts use the device best. p-spg-fb starts where apgd stalls, from its
// best x.
Solution solve_on_device(const Problem& problem, const Options& options, Budget& budget) {
  const Field field{{start_apgd, "on the device"}, {start_spg, "takes the last digits"}};
  Solution s = in_order(problem, options, budget, field);
  s.device = device_of(problem, options);
  return s;
}

// A start that meets the tolerance is the solution, as for every method.
bool accepts_start(const Problem& problem, const Options& options, Solution& s) {
  if (options.x0.empty() || options.history || options.callback) return false;
  measure_start(problem, options, s);
  if (!(s.residual <= options.tolerance)) return false;
  s = accepted(std::move(s), "elimination");
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
Solution solve_directly_or_in_order(const Problem& problem, const Options& options, Budget& budget) {
  Elimination elimination;
  Solution s;
  if (!solve_directly(problem, options, budget, elimination, s))
    return solve_in_order(problem, options, budget);
  name_elimination(s);
  return s;
}

// Solves the whole problem once more after the direct way has failed. It starts from zero, because near the
// best x Coulomb's law may have no solution. The budget of a step bounds the work, so that a jammed robot
// does not stop a simulation. Methods have limits of their own elsewhere.
Solution after_elimination(const Problem& problem, const Options& options, Budget& budget,
                           const Elimination& elimination, Solution s) {
  Options rest = options;
  rest.x0 = {};
  if (s.status != Status::stalled || !elimination.fell_short() || budget.late()) return s;
  if (options.max_iterations) {
    if (s.iterations >= options.max_iterations) return s;
    rest.max_iterations = options.max_iterations - s.iterations;
  }
  Solution second = solve_by_islands(problem, rest, budget, solve_in_order);
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
  const Field field{{start_central_path, "follows the central path"},
                    {start_newton, "finds the faces that hold the path back", choice::policy.first_turn},
                    {start_spg, "takes the last digits"}};
  return in_order(problem, options, budget, field);
}

// A single problem.
Solution automatic(const Problem& problem, const Options& options, Budget& budget) {
  if (on_device(problem, options)) return solve_on_device(problem, options, budget);
  if (Solution s; accepts_start(problem, options, s)) return s;
  // A large linear system: conjugate gradients are tried before a factorisation.
  if (problem.K.all_bilateral() && problem.rows() > choice::policy.most_rows) {
    Solution s = solve_in_order(problem, options, budget);
    if (s.status != Status::stalled) return s;
  }
  Elimination elimination;
  Solution s;
  if (!solve_directly(problem, options, budget, elimination, s))
    s = solve_by_islands(problem, options, budget, solve_directly_or_in_order);
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

Solution solve_iteratively(const Problem& problem, const Options& options, Budget& budget) {
  if (on_device(problem, options)) return solve_on_device(problem, options, budget);
  return solve_by_islands(problem, options, budget, solve_directly_or_in_order);
}

// A step of a simulation.
Solution automatic(const Problem& problem, const Options& options, Budget& budget, Elimination& elimination,
                   Solution memory) {
  Solution s = std::move(memory);
  if (!solve_directly(problem, options, budget, elimination, s))
    s = solve_iteratively(problem, options, budget);
  return s;
}

}  // namespace amontons
