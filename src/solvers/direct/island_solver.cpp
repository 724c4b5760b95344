#include "solvers/direct/island_solver.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/elementary.hpp"
#include "amontons/base/interrupt.hpp"
#include "amontons/base/policy.hpp"
#include "amontons/problem/residual.hpp"
#include "solvers/direct/policy.hpp"
#include "solvers/linear/row_kernel.hpp"

namespace amontons {

// Multiplications of short rows per unit of work: half as many as in dense kernels.
static constexpr double multiplications_in_unit = 0.5 * Budget::multiplications;

// Steps of a search for faces, and of a curve, where the caller sets no limit.
static constexpr std::size_t most_steps = 150;  // not tuned: a default, options may set others

// The mean of diag(W) per block scales the natural map of the steps; positive for immobile blocks too.
void IslandSolver::start(const Reduction::Island& island) {
  island_ = &island;
  const std::size_t m = island.rows();
  for (std::vector<double>* v : {&x_, &u_, &dx_, &trial_, &trial_u_, &best_}) v->resize(m);
  p_.resize(island.K.blocks());
  double largest = 0;
  diagonal_.resize(m);
  for (std::size_t i = 0; i < m; ++i) diagonal_[i] = island.diagonal(i);
  for (const double d : diagonal_) largest = std::max(largest, d);
  const double floor = largest > 0 ? base::policy.rounding * largest : 1.0;
  for_each_block(island.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    double mean = 0;
    for (int k = 0; k < S::dim; ++k) mean += diagonal_[row + k] / S::dim;
    p_[block] = std::max(mean, floor);
  });
  result_ = {false, INFINITY, 0, 0};
  work_ = 0;
  swept_ = false;
}

// u = W x + q. An island with more rows than coordinates has W in factors, and nothing else differs here.
void IslandSolver::evaluate(const std::vector<double>& x, std::vector<double>& u) {
  u = island_->q;
  const std::size_t m = x.size();
  if (!island_->thin.empty()) {
    work_ += 2 * m * island_->thin.n;
    island_->thin.add_product(x, u);
    return;
  }
  work_ += m * m;
  AMONTONS_DISPATCH(add_product, u.data(), x.data(), island_->W.data(), m, m);
}

double IslandSolver::natural_map(const std::vector<double>& x, const std::vector<double>& u) const {
  double sum = 0;
  for_each_block(island_->K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double g[S::dim];
    add_de_saxce_term(set, law_, &u[row], g);
    sum += natural_map_squared(set, island_->P[block], &x[row], g);
  });
  return std::sqrt(sum);
}

// Keeps x if it is the best so far by its natural map, which is returned.
double IslandSolver::keep_better(const std::vector<double>& x, const std::vector<double>& u) {
  const double map = natural_map(x, u);
  if (map < result_.map) {
    result_.map = map;
    best_ = x;
  }
  return map;
}

IslandSolver::Result IslandSolver::solve(const Reduction::Island& island, Law law, const Limits& limits,
                                         Budget& budget, std::vector<double>& x) {
  law_ = law;
  limits_ = limits;
  budget_ = &budget;
  start(island);
  choose_start(x);
  if (result_.map > limits_.aim) find_faces();
  if (result_.map > limits_.target) follow_curve();
  x = best_;
  pay();
  result_.solved = result_.map <= limits_.target;
  return result_;
}

// Newton steps begin at the given start. Zero impulses are kept, too, as most contacts may have opened: then
// they are the better x. But the map says little of faces. Where two feet push against each other, a small
// error of the impulses has a larger map than zero, with all faces right.
void IslandSolver::choose_start(std::vector<double>& x) {
  std::fill(x_.begin(), x_.end(), 0.0);
  project(island_->K, x_, x_);
  evaluate(x_, u_);
  keep_better(x_, u_);
  if (x.size() != x_.size()) return;
  project(island_->K, x, x_);
  evaluate(x_, u_);
  keep_better(x_, u_);
}

// Each step is charged before the next, so that a budget is passed by the work of one step at most.
bool IslandSolver::has_budget() {
  pay();
  return (limits_.iterations == 0 || result_.iterations < limits_.iterations) && !budget_->exhausted() &&
         !budget_->late() && !Interrupt::requested();
}

// Charges the work since the last call.
void IslandSolver::pay() {
  budget_->spend(static_cast<double>(work_) / multiplications_in_unit);
  work_ = 0;
}

// Newton steps from the present x. The map may rise on the way to the right faces, so the best x is kept.
//
// A step fails where faces contradict each other, such as three corners that stick with gaps that no rigid
// motion closes. The proximal term alone decides there: an error e in the null space of W moves x by e over
// it, far beyond other faces. So it grows with each failure. After each success it falls in proportion to the
// map, which keeps convergence quadratic without regularity (Yamashita, Fukushima 2001), or faster.
void IslandSolver::find_faces() {
  std::size_t stale = 0;
  // After as many failures as are allowed the term is as large as the diagonal of W.
  const double growth =
      1 + elementary::expm1(-elementary::log(base::policy.compliance) / direct::policy.stale_steps);
  double proximal = base::policy.compliance;
  for (std::size_t i = 0; i < most_steps && stale < direct::policy.stale_steps; ++i) {
    if (!has_budget()) return;
    const double before = result_.map;
    if (!newton_step(proximal)) return;
    keep_better(x_, u_);
    // One more step after the target is reached: quadratic convergence brings it to rounding.
    if (result_.map <= limits_.aim || before <= limits_.target) return;
    if (result_.map < before) {
      proximal = std::max(base::policy.compliance, 0.5 * proximal * result_.map / before);
      continue;
    }
    ++stale;
    proximal *= growth;
    settle();
  }
}

// Sweeps from the best x, with as many multiplications as the Newton step that failed.
void IslandSolver::settle() {
  if (!swept_) sweeps_.start(*island_, law_, p_);
  const std::uint64_t begin = swept_ ? sweeps_.work() : 0;
  swept_ = true;
  x_ = best_;
  sweeps_.begin_at(x_);
  const std::uint64_t end = sweeps_.work() + newton_.work();
  while (sweeps_.work() < end) sweeps_.sweep(x_);
  work_ += sweeps_.work() - begin;
  evaluate(x_, u_);
  keep_better(x_, u_);
}

// A full step without a line search: a shorter step would stop at the first wrong face. x is projected,
// because dx respects faces and not cones.
bool IslandSolver::newton_step(double proximal) {
  ++result_.iterations;
  const bool solved = newton_.solve(*island_, {law_, p_, x_, u_}, proximal, dx_);
  if (newton_.work() > 0) ++result_.factorizations;
  work_ += newton_.work();
  if (!solved) return false;
  for (std::size_t i = 0; i < x_.size(); ++i) x_[i] += dx_[i];
  project(island_->K, x_, x_);
  evaluate(x_, u_);
  return true;
}

// Follows the central curve: from a point near the best x, and from the middle of the sets if that one fails.
// A contact between two faces has x and w of the size of sqrt(t): the curve ends where that is rounding.
void IslandSolver::follow_curve() {
  system_.start(*island_, p_);
  if (!start_near() || !follow(true)) {
    curve_.start(system_, island_->K, law_);
    follow(false);
  }
  x_ = best_;
  evaluate(x_, u_);
  if (result_.map > limits_.aim) find_faces();
}

// Starts with x o w = t e, where t is the largest error of a block in the units of the curve.
//
// In these units impulses and velocities are of order one. On the curve a contact that carries 1 has a
// velocity of t. An open one with a velocity of 1 has an impulse of t. Both differ from the solution by about
// the error of x. A contact with both below sqrt(t) is between its faces, and the curve decides. A smaller t
// would keep faces that are wrong, and lead along the boundary, where steps are short. A larger one forgets
// what x knows.
//
// The curve from the middle takes some ten steps to where faces are decided, and three or four from there.
bool IslandSolver::start_near() {
  evaluate(best_, u_);
  trial_ = best_;
  trial_u_ = u_;
  system_.units().from_impulses(trial_);
  system_.units().from_velocities(trial_u_);
  double t = base::policy.rounding;
  for_each_block(island_->K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double g[S::dim];
    add_de_saxce_term(set, law_, &u_[row], g);
    t = std::max(t, std::sqrt(natural_map_squared(set, p_[block], &best_[row], g) / p_[block]) /
                        system_.units().of_x()[block]);
  });
  return t < 1 && curve_.start_near(system_, island_->K, law_, trial_, trial_u_, t);
}

// Returns whether the target is reached. `near`: the curve is left where t has risen by half of its fall, in
// digits; at most folds it rises less. Nearly all Newton steps fail as long as faces change. Where t falls
// faster than in the step before, one may take the place of the last steps along the curve, which cost more.
bool IslandSolver::follow(bool near) {
  const double first = curve_.t(), end = base::policy.rounding * base::policy.rounding;
  double least = first, before = first, fall = 0;
  for (std::size_t i = 0, tried = 0; i < most_steps && is_unsolved(); ++i) {
    ++result_.iterations;
    ++result_.factorizations;
    work_ += system_.work();
    if (!curve_.step()) break;
    curve_.x(x_);
    system_.units().to_impulses(x_);
    evaluate(x_, u_);
    keep_better(x_, u_);
    const double t = curve_.t();
    if ((near && t * t > first * least) || t < end) break;
    const bool faster = t < fall * before && tried < direct::policy.stale_steps;
    if (faster && is_unsolved() && newton_step(base::policy.compliance)) keep_better(x_, u_);
    tried += faster;
    fall = t / before;
    least = std::min(least, t);
    before = t;
  }
  return result_.map <= limits_.target;
}

}  // namespace amontons
