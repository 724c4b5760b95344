#include "amontons/solvers/direct/elimination.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "amontons/base/policy.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/driver.hpp"
#include "amontons/solvers/driver/parts.hpp"
#include "solvers/direct/island_solver.hpp"
#include "solvers/direct/policy.hpp"
#include "solvers/direct/reduction.hpp"

namespace amontons {

struct Elimination::Memory {
  const Problem* problem = nullptr;
  const Options* options = nullptr;
  Budget* budget = nullptr;
  // Natural maps: at zero impulses; the target of all islands together.
  double scale = 0, whole = 0;
  std::vector<std::size_t> order;
  Reduction reduction;
  IslandSolver small;
  std::vector<double> part;
  // Used by complete(), for problems with islands of many rows.
  Mechanism mechanism;
  std::vector<double> wrenches, z;
  std::vector<char> short_of;  // per island: whether it missed its target
  bool solved() const { return std::find(short_of.begin(), short_of.end(), 1) == short_of.end(); }

  bool reduce(const Problem& problem);
  void solve_islands(std::span<const double> start, Solution& s);
  double complete(Solution& s);
  double form_u(Solution& s) const;
};

Elimination::Elimination() : memory_(std::make_unique<Memory>()) {}
Elimination::~Elimination() = default;

// x of the remaining rows, island by island. The squares of the islands' natural maps sum to that of the
// whole. An island may leave an even share of the part that earlier islands did not use. Small
// islands are solved to rounding, so the largest, which comes last, has nearly the whole target.
void Elimination::Memory::solve_islands(std::span<const double> start, Solution& s) {
  const std::size_t count = reduction.islands();
  short_of.assign(count, 0);
  order.resize(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(reduction.island(a).rows(), a) < std::pair(reduction.island(b).rows(), b);
  });
  const double even = whole / std::sqrt(static_cast<double>(count));
  double left = whole * whole;
  for (std::size_t solved = 0; solved < count; ++solved) {
    const std::size_t i = order[solved];
    const Reduction::Island& island = reduction.island(i);
    const double target = std::sqrt(left / static_cast<double>(count - solved));
    part.clear();
    if (!start.empty())
      for (std::size_t row : island.row) part.push_back(start[row]);
    const IslandSolver::Result result =
        small.solve(island, law_of(*problem, *options),
                    {target, direct::policy.aim * even, options->max_iterations}, *budget, part);
    s.iterations += result.iterations;
    s.factorizations += result.factorizations;
    short_of[i] = !result.solved;
    const double reached = std::min(result.map, target);
    left -= reached * reached;
    for (std::size_t k = 0; k < part.size(); ++k) s.x[island.row[k]] = part[k];
  }
}

// Forms u = A x + b; returns the natural map of the bilateral rows, |P^-1/2 u_f|.
double Elimination::Memory::form_u(Solution& s) const {
  s.u.resize(problem->rows());
  product(problem->A, s.x, s.u);
  ++s.products;
  for (std::size_t i = 0; i < s.u.size(); ++i) s.u[i] += problem->b[i];
  double sum = 0;
  for (const SetRun& run : problem->K.runs()) {
    if (run.kind != kind_of<Bilateral>) continue;
    for (std::size_t i = 0; i < run.count; ++i)
      sum += s.u[run.row + i] * s.u[run.row + i] / problem->P[run.block + i];
  }
  return std::sqrt(sum);
}

// Completes x by the bilateral rows, forms u and the residual of the problem; returns the map of those rows.
// Rounds remove the error of K as long as they halve it; the rest is rounding.
double Elimination::Memory::complete(Solution& s) {
  reduction.recover(s.x);
  double bilateral = form_u(s), before = std::numeric_limits<double>::infinity();
  const double enough = std::max(base::policy.rounding, direct::policy.aim * options->tolerance) * scale;
  while (bilateral > enough && bilateral < 0.5 * before) {
    before = bilateral;
    reduction.correct(s.u, s.x);
    bilateral = form_u(s);
  }
  s.residual = natural_map(*problem, law_of(*problem, *options), s.x, s.u) / scale;
  return bilateral;
}

bool Elimination::Memory::reduce(const Problem& p) {
  if (!reduction.analyse(p, direct::policy.most_rows) || !reduction.factor(p)) return false;
  budget->spend(reduction.work() / Budget::multiplications);
  return true;
}

bool Elimination::solve(const Problem& problem, const Options& options, Budget& budget, Solution& s) {
  if (options.history || options.callback) return false;
  const auto start = std::chrono::steady_clock::now();
  Memory& m = *memory_;
  m.budget = &budget;
  if (!m.reduce(problem)) return false;
  m.problem = &problem;
  m.options = &options;
  m.scale = natural_map_at_zero(problem, law_of(problem, options));
  m.whole = direct::policy.reduced_share * options.tolerance * m.scale;
  clear_counts(s);
  s.factorizations = 1;
  s.objective = 0;
  s.x.assign(problem.rows(), 0.0);
  m.solve_islands(options.x0, s);
  double bilateral = m.complete(s);
  // W has the rounding of a factorisation and the least compliance of K; with very different masses these may
  // exceed the tolerance. The u of the problem itself then gives the correct q (defect correction). A round
  // that does not halve the residual leaves its own rounding.
  for (double before = std::numeric_limits<double>::infinity();
       s.residual > options.tolerance && s.residual < 0.5 * before && m.solved() && !budget.late();) {
    before = s.residual;
    for (std::size_t i = 0; i < m.reduction.islands(); ++i) m.reduction.island(i).shift(s.x, s.u);
    m.solve_islands(s.x, s);
    bilateral = m.complete(s);
  }
  // Contradictory rows are left to methods that can prove the contradiction.
  if (!(bilateral <= options.tolerance * m.scale)) return false;
  for (std::size_t i = 0; i < s.x.size(); ++i) s.objective += 0.5 * s.x[i] * (s.u[i] + problem.b[i]);
  s.time = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  s.status = s.residual <= options.tolerance ? Status::converged
             : budget.late()                 ? Status::deadline
                                             : Status::stalled;
  s.method = "elimination";
  return true;
}

bool Elimination::fell_short() const { return !memory_->solved(); }

bool Elimination::restore_joints(const Problem& problem, std::span<double> x) {
  if (!memory_->mechanism.factor_held(problem)) return false;
  memory_->mechanism.hold(problem, x, memory_->wrenches, memory_->z);
  return true;
}

}  // namespace amontons
