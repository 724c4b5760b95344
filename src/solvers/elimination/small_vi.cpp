#include "solvers/elimination/small_vi.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/patience.hpp"
#include "amontons/problem/residual.hpp"
#include "solvers/linear/row_kernel.hpp"

namespace amontons {

namespace {

// Directions in which W is softer than the proximal term come in at its rate only, and more slowly than by
// `slow`: then it falls.
constexpr double slow = 0.1, proximal_fall = 0.1, smallest_proximal = 1e-13, largest_proximal = 1;
// Newton steps towards the aim once the target is reached.
constexpr std::size_t polish_steps = 1;
// Times the natural map of no impulses: a start below it may have the right faces, however wrong its impulses
// are, and a few Newton steps tell.
constexpr double far_off = 10;
// Along the central curve: what one takes that bends little, and where one is given up; where it has ended.
constexpr std::size_t usual_curve_steps = 15, most_curve_steps = 150;
constexpr double end_of_curve = 1e-30;
// How many steps pass before convex problems are solved, how many of them, and of each the same.
constexpr std::size_t patient_curve_steps = 30, most_convex_steps = 40;
constexpr int convex_rounds = 2;
constexpr double end_of_convex = 1e-10;
// Gradient steps from nothing before the first faces: they share loads evenly where those are not determined;
// and where no faces are found, before they are looked for again: all of them cost less than the curve.
constexpr std::size_t cold_descent = 24, second_descent = 100;
// Solving for the contacts that act alone: of what is asked for, as others add to it; rounds; of the rows of
// all, above which it is not worth it.
constexpr double share_of_acting = 0.9, most_acting = 0.9;
constexpr int acting_rounds = 3;
// In all: multiplications, with so many for each row of a projection or a natural map; and times m^3; beside
// them the steps along the curve. What is not solved by then, which is rare, is left to the methods of
// automatic.cpp.
constexpr std::size_t most_work = 1'000'000, most_per_cube = 2, multiplications = 30;
// Between two looks at the Patience of the thread: some microseconds.
constexpr std::size_t unwatched_work = 5'000;
// In a unit of work: rows are short and the loops over blocks do other things than multiply.
constexpr double small_multiplications = 0.5 * Patience::multiplications;
// Of the work that is left (Patience), for a curve that bends little: where it is more, it is not begun.
constexpr double share_of_curve = 0.4;

// The blocks of an island that are marked, as an island whose rows are counted in the first.
Reduction::Island part(const Reduction::Island& island, const std::vector<char>& marked) {
  Reduction::Island part;
  for_each_block(island.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    if (!marked[block]) return;
    part.K.append(set);
    part.P.push_back(island.P[block]);
    for (int k = 0; k < S::dim; ++k) part.row.push_back(row + k);
  });
  for (std::size_t i : part.row) {
    part.q.push_back(island.q[i]);
    for (std::size_t j : part.row) part.W.push_back(island.W[island.rows() * i + j]);
  }
  return part;
}

}  // namespace

// For the faces of the start, which mostly are right: a term that makes a regular matrix where contacts
// outnumber the freedoms of the bodies, and changes their distribution no more than it has to.
const SmallVi::Faces SmallVi::at_once{10, 4, 1e-7, 1};
// Where they were wrong: redundant contacts that oppose slips of 1e-7 m/s would be moved far away by those,
// and the steps end at faces of which nothing is true.
const SmallVi::Faces SmallVi::carefully{20, 8, 1e-3, 10};

// The mean of diag(W) per block scales the natural map of the steps; positive for blocks that nothing moves.
void SmallVi::start(const Reduction::Island& island) {
  island_ = &island;
  const std::size_t m = island.rows();
  for (std::vector<double>* v : {&x_, &u_, &dx_, &trial_, &trial_u_, &best_, &du_}) v->resize(m);
  p_.resize(island.K.blocks());
  double largest = 0;
  for (std::size_t i = 0; i < m; ++i) largest = std::max(largest, island.W[(m + 1) * i]);
  const double floor = largest > 0 ? 1e-14 * largest : 1.0;
  for_each_block(island.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    double mean = 0;
    for (int k = 0; k < S::dim; ++k) mean += island.W[(m + 1) * (row + k)] / S::dim;
    p_[block] = std::max(mean, floor);
  });
  result_ = {};
  work_ = paid_ = 0;
  most_work_ = most_work + most_per_cube * m * m * m;
}

// u += W x
void SmallVi::add_product(const std::vector<double>& x, std::vector<double>& u) {
  const std::size_t m = x.size();
  work_ += m * (m + multiplications);
  AMONTONS_DISPATCH(add_product, u.data(), x.data(), island_->W.data(), m);
}

// u = W x + q
void SmallVi::evaluate(const std::vector<double>& x, std::vector<double>& u) {
  u = island_->q;
  add_product(x, u);
}

double SmallVi::natural_map(const std::vector<double>& x, const std::vector<double>& u) const {
  double sum = 0;
  for_each_block(island_->K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double g[S::dim];
    add_saxce_term(set, law_, &u[row], g);
    sum += natural_map_squared(set, island_->P[block], &x[row], g);
  });
  return std::sqrt(sum);
}

// x, if it is the best so far by its natural map, which is returned.
double SmallVi::keep(const std::vector<double>& x, const std::vector<double>& u) {
  const double map = natural_map(x, u);
  if (map < result_.map) {
    result_.map = map;
    best_ = x;
  }
  return map;
}

void SmallVi::begin() {
  ended_ = false;
  unpaid_ = 0;
}

SmallVi::Result SmallVi::solve(const Reduction::Island& island, Law law, const Limits& limits,
                               std::vector<double>& x) {
  return search(island, law, limits, x, Of::whole);
}

SmallVi::Result SmallVi::search(const Reduction::Island& island, Law law, const Limits& limits,
                                std::vector<double>& x, Of of) {
  law_ = law;
  start(island);
  // From the start that was given, or from nothing if that is much nearer.
  result_.map = INFINITY;
  start_from_nothing();
  const double nothing = keep(x_, u_);
  bool warm = false;
  if (x.size() == island.rows()) {
    project(island.K, x, trial_);
    evaluate(trial_, trial_u_);
    if ((warm = keep(trial_, trial_u_) < far_off * nothing)) {
      x_.swap(trial_);
      u_.swap(trial_u_);
    }
  }
  limits_ = limits;
  if (!warm) descend(cold_descent);
  if (!done()) find_faces(of == Of::whole ? at_once : carefully);
  const auto unsolved = [&] { return result_.map > limits.target && left(); };
  if (of == Of::whole && unsolved()) {
    restart();
    find_faces(carefully);
    if (unsolved()) solve_acting();
  }
  if (unsolved()) {
    restart();
    descend(second_descent);
    if (!done()) find_faces(carefully);
  }
  if (result_.map > limits.target) follow_curve();
  x = best_;
  unpaid_ += work_ - paid_;
  return result_;
}

// The blocks that act at the best x by themselves, then with those that act there, until these are all. Most
// contacts of a body that tumbles are open: what looks for faces or follows a curve costs the cube of the
// rows.
void SmallVi::solve_acting() {
  restart();
  acts_.assign(island_->K.blocks(), false);
  acting_ = {};
  if (!acting_vi_) acting_vi_ = std::make_unique<SmallVi>();
  Limits limits = limits_;
  limits.target *= share_of_acting;
  limits.aim *= share_of_acting;
  const std::size_t m = x_.size();
  for (int round = 0; round < acting_rounds && result_.map > limits_.target && left(); ++round) {
    const std::size_t rows = add_acting();
    if (rows == acting_.rows() || static_cast<double>(rows) > most_acting * static_cast<double>(m)) return;
    acting_ = part(*island_, acts_);
    acting_x_.resize(rows);
    for (std::size_t i = 0; i < rows; ++i) acting_x_[i] = x_[acting_.row[i]];
    if (limits_.iterations) limits.iterations = limits_.iterations - result_.iterations;
    pay();
    acting_vi_->begin();
    const Result result = acting_vi_->search(acting_, law_, limits, acting_x_, Of::acting);
    acting_vi_->pay();
    result_.iterations += result.iterations;
    result_.factorizations += result.factorizations;
    std::fill(x_.begin(), x_.end(), 0.0);
    for (std::size_t i = 0; i < rows; ++i) x_[acting_.row[i]] = acting_x_[i];
    evaluate(x_, u_);
    keep(x_, u_);
    if (!(result.map <= limits.target)) return;
  }
}

// To acts_ what acts at x: its impulse is not zero, or not the answer to u. How many rows act then. Sets
// without zero always act.
std::size_t SmallVi::add_acting() {
  std::size_t rows = 0;
  for_each_block(island_->K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    if (!acts_[block]) {
      double g[S::dim];
      add_saxce_term(set, law_, &u_[row], g);
      acts_[block] = !(S::frictional || std::is_same_v<S, NonNegative>) ||
                     std::any_of(&x_[row], &x_[row] + S::dim, [](double r) { return r != 0; }) ||
                     natural_map_squared(set, p_[block], &x_[row], g) != 0;
    }
    if (acts_[block]) rows += S::dim;
  });
  return rows;
}

bool SmallVi::done() const { return result_.map <= limits_.aim; }

bool SmallVi::left() {
  if (unpaid_ + work_ - paid_ >= unwatched_work) pay();
  return !ended_ && work_ < most_work_ &&
         (limits_.iterations == 0 || result_.iterations < limits_.iterations);
}

// Charges what was done since the last call, and sees whether that was all that may be.
void SmallVi::pay() {
  Patience::spend(static_cast<double>(unpaid_ + work_ - paid_) / small_multiplications);
  unpaid_ = 0;
  paid_ = work_;
  ended_ = ended_ || Patience::exhausted() || Patience::late() || Patience::interrupted();
}

// Newton steps from the present x. The natural map may rise on the way to the right faces: what counts is the
// best that is seen.
void SmallVi::find_faces(const Faces& how) {
  double sigma = how.proximal;
  std::size_t stale = 0, polish = 0;
  for (std::size_t i = 0; i < how.steps && stale < how.patience && left(); ++i) {
    const double before = result_.map;
    if (!newton_step(sigma)) return;
    keep(x_, u_);
    if (done()) return;
    stale = result_.map < before ? 0 : stale + 1;
    if (stale > 0)
      sigma = std::min(largest_proximal, how.rise * sigma);
    else if (result_.map > slow * before)
      sigma = std::max(smallest_proximal, proximal_fall * sigma);
    if (result_.map <= limits_.target && (stale > 0 || ++polish == polish_steps)) return;
  }
}

// Along the central curve. To look for the faces on the way is dearer than to go on: nearly all steps of
// Newton's method are in vain as long as faces change. A curve that takes its time has folds, and there may
// be more of them than it is worth: then the faces are looked for from elsewhere.
void SmallVi::follow_curve() {
  const std::size_t m = x_.size();
  // The multiplications m^3 / 3 are those of a dense kernel, four in the time of one of the rest.
  work_of_step_ = m * m * (m + 90) / 12;
  const double left_to_all = std::max(0.0, Patience::work_left()) * small_multiplications;
  if (static_cast<double>(usual_curve_steps * work_of_step_) > share_of_curve * left_to_all) return;
  most_work_ = work_ + most_curve_steps * work_of_step_ + most_work;
  system_.start(*island_, p_);
  curve_.start(system_, island_->K, law_);
  for (std::size_t i = 0; i < most_curve_steps && result_.map > limits_.target && left(); ++i) {
    if (i == patient_curve_steps && law_ == Law::coulomb && start_from_convex()) return;
    if (!step_along(curve_) || curve_.t() < end_of_curve) break;
  }
  restart();
  if (!done()) find_faces(at_once);
}

// A step along a curve, to where x is.
bool SmallVi::step_along(CentralCurve<IslandSystem>& curve) {
  ++result_.iterations;
  ++result_.factorizations;
  work_ += work_of_step_;
  if (!curve.step()) return false;
  curve.x(x_);
  system_.units().to_impulses(x_);
  evaluate(x_, u_);
  keep(x_, u_);
  return true;
}

// The faces from the solution of a convex problem, the curve of which has no folds: with the De Saxce term
// held, at none first, then at what it is at that solution (Acary, Cadoux, Lemarechal, Malick, "A formulation
// of the linear discrete Coulomb friction problem via convex optimization", ZAMM 91, 2011). Whether that
// found them; if not, the curve goes on.
bool SmallVi::start_from_convex() {
  held_ = island_->q;
  for (int round = 0; round < convex_rounds; ++round) {
    system_.set_q(held_);
    convex_.start(system_, island_->K, Law::associated);
    for (std::size_t i = 0; i < most_convex_steps && left(); ++i)
      if (!step_along(convex_) || convex_.t() < end_of_convex) break;
    held_ = island_->q;
    for_each_block(island_->K, [&]<class S>(const S& set, std::size_t, std::size_t row) {
      if constexpr (S::frictional) held_[row] += set.saxce(&u_[row]);
    });
    find_faces(at_once);
    if (result_.map <= limits_.target) return true;
  }
  system_.set_q(island_->q);
  return false;
}

// A whole step, wherever it leads: faces are found by going there, and a shorter step would stop at the first
// that is wrong. Projected, as dx knows faces and not cones.
bool SmallVi::newton_step(double sigma) {
  ++result_.iterations;
  const bool solved = newton_.solve(*island_, law_, p_, sigma, x_, u_, dx_);
  if (const std::size_t rows = newton_.rows(); rows > 0) {
    ++result_.factorizations;
    work_ += rows * rows * (rows + 9) / 3;
  }
  if (!solved) return false;
  for (std::size_t i = 0; i < x_.size(); ++i) x_[i] += dx_[i];
  project(island_->K, x_, x_);
  evaluate(x_, u_);
  return true;
}

// Accelerated projected gradients from the present x as in first_order/apgd.cpp, in the metric of W.
void SmallVi::descend(std::size_t steps) {
  std::vector<double>&y = trial_, &u_y = trial_u_, &d = dx_, &Wd = du_;
  y = x_;
  u_y = u_;
  double L = 1, theta = 1;
  for (std::size_t i = 0; i < steps && result_.map > limits_.target && left(); ++i) {
    ++result_.iterations;
    double dPd, dPm, dWd;
    for (;;) {
      momentum_direction(L, dPd, dPm);
      dWd = multiply(d, Wd);
      if (dWd <= L * dPd || !(dPd > 0)) break;
      L = std::max(2 * L, dWd / dPd);
    }
    const bool uphill = -(dPd + dPm) > 0;
    const double next = 0.5 * theta * (std::sqrt(theta * theta + 4) - theta);
    const double beta = uphill ? 0.0 : theta * (1 - theta) / (theta * theta + next);
    theta = uphill ? 1.0 : next;
    L *= 0.95;
    for (std::size_t k = 0; k < x_.size(); ++k) {
      const double x = y[k] + d[k], u = u_y[k] + Wd[k];
      y[k] = x + beta * (x - x_[k]);
      u_y[k] = u + beta * (u - u_[k]);
      x_[k] = x;
      u_[k] = u;
    }
    keep(x_, u_);
  }
  evaluate(x_, u_);
}

// d = Pi(y - g / (L p)) - y, <d, P d> and <d, P (y - x)>.
void SmallVi::momentum_direction(double L, double& dPd, double& dPm) {
  dPd = dPm = 0;
  for_each_block(island_->K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    const double p = p_[block];
    double g[S::dim], z[S::dim];
    add_saxce_term(set, law_, &trial_u_[row], g);
    for (int k = 0; k < S::dim; ++k) z[k] = trial_[row + k] - g[k] / (L * p);
    set.project(z, z);
    for (int k = 0; k < S::dim; ++k) {
      const double d = dx_[row + k] = z[k] - trial_[row + k];
      dPd += p * d * d;
      dPm += p * d * (trial_[row + k] - x_[row + k]);
    }
  });
}

// Wd = W d; <d, W d>
double SmallVi::multiply(const std::vector<double>& d, std::vector<double>& Wd) {
  std::fill(Wd.begin(), Wd.end(), 0.0);
  add_product(d, Wd);
  double sum = 0;
  for (std::size_t i = 0; i < d.size(); ++i) sum += d[i] * Wd[i];
  return sum;
}

void SmallVi::start_from_nothing() {
  std::fill(x_.begin(), x_.end(), 0.0);
  project(island_->K, x_, x_);
  evaluate(x_, u_);
}

void SmallVi::restart() {
  x_ = best_;
  evaluate(x_, u_);
}

}  // namespace amontons
