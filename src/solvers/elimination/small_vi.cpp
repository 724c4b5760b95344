// Newton's equation, docs/algorithm.md (33). Each block has an equation F(x, u) = 0, u = W x + q
// (block_equation.hpp), and dF = G dx + H du:  (G + H W) dx = -F. Blocks at a bound have H = 0, dx = -F: only
// the others, those that act, are factored.
#include "solvers/elimination/small_vi.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/base/patience.hpp"
#include "amontons/problem/residual.hpp"
#include "solvers/elimination/block_equation.hpp"
#include "solvers/linear/row_kernel.hpp"

namespace amontons {

namespace {

// Newton steps in a row, and how many of them may pass without a better x.
constexpr std::size_t newton_steps = 10, patience = 4;
// Newton steps towards the aim once the target is reached.
constexpr std::size_t polish_steps = 1;
// Times diag(W), added to W in a step: a regular matrix where contacts outnumber the freedoms of the bodies.
// The step then changes their distribution no more than it has to.
constexpr double proximal = 1e-7, smallest_proximal = 1e-13;
// Directions in which W is softer than that come in at this rate only, and more slowly than by `slow`: then
// the term falls.
constexpr double slow = 0.1, proximal_fall = 0.1;
// The same where the faces of the start were wrong: redundant contacts that oppose slips of 1e-7 m/s would be
// moved far away by those, and the steps end at faces of which nothing is true. The term falls as they lead
// on, and rises where they do not.
constexpr std::size_t careful_steps = 20, more_patience = 8;
constexpr double careful_proximal = 1e-3, largest_proximal = 1, proximal_rise = 10;
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

}  // namespace

// The mean of diag(W) per block scales the natural map of the steps; positive for blocks that nothing moves.
void SmallVi::start(const Reduction::Island& island) {
  island_ = &island;
  const std::size_t m = island.rows();
  for (std::vector<double>* v : {&x_, &u_, &dx_, &trial_, &trial_u_, &best_, &du_, &centre_}) v->resize(m);
  p_.resize(island.K.blocks());
  linear_.resize(island.K.blocks());
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
  if (!done()) find_faces();
  if (result_.map > limits.target && left()) {
    restart();
    descend(second_descent);
    if (!done()) find_faces_carefully();
  }
  if (result_.map > limits.target) follow_curve();
  x = best_;
  unpaid_ += work_ - paid_;
  return result_;
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

// Newton steps from the present x, each regularised about the point where it starts. The natural map may rise
// on the way to the right faces: what counts is the best that is seen.
void SmallVi::find_faces() {
  sigma_ = proximal;
  std::size_t stale = 0, polish = 0;
  for (std::size_t i = 0; i < newton_steps && stale < patience && left(); ++i) {
    const double before = result_.map;
    centre_ = x_;
    linearise();
    if (!newton_step()) return;
    keep(x_, u_);
    if (done()) return;
    stale = result_.map < before ? 0 : stale + 1;
    if (stale == 0 && result_.map > slow * before)
      sigma_ = std::max(smallest_proximal, proximal_fall * sigma_);
    if (result_.map <= limits_.target && (stale > 0 || ++polish == polish_steps)) return;
  }
}

// The same with a term that adapts.
void SmallVi::find_faces_carefully() {
  sigma_ = careful_proximal;
  std::size_t stale = 0;
  for (std::size_t i = 0; i < careful_steps && stale < more_patience && left(); ++i) {
    const double before = result_.map;
    centre_ = x_;
    linearise();
    if (!newton_step()) return;
    keep(x_, u_);
    if (done() || (before <= limits_.target && result_.map > slow * before)) return;
    stale = result_.map < before ? 0 : stale + 1;
    sigma_ = stale == 0 ? std::max(smallest_proximal, proximal_fall * sigma_)
                        : std::min(largest_proximal, proximal_rise * sigma_);
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
  if (!done()) find_faces();
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
    find_faces();
    if (result_.map <= limits_.target) return true;
  }
  system_.set_q(island_->q);
  return false;
}

// A whole step, wherever it leads: faces are found by going there, and a shorter step would stop at the first
// that is wrong. Projected, as dx knows faces and not cones.
bool SmallVi::newton_step() {
  ++result_.iterations;
  if (!solve_linear()) return false;
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

// At x, of the problem regularised about the centre.
void SmallVi::linearise() {
  for_each_block(island_->K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    Linear& l = linear_[block];
    const double p = p_[block];
    double u[S::dim];
    for (int k = 0; k < S::dim; ++k) u[k] = u_[row + k] + sigma_ * p * (x_[row + k] - centre_[row + k]);
    l.row = row;
    l.dim = S::dim;
    block_equation(set, law_, p, &x_[row], u, l.F, l.G, l.H);
    l.acts = std::any_of(l.H, l.H + S::dim * S::dim, [](double h) { return h != 0; });
  });
}

// A row of H times W.
const double* SmallVi::product_row(const Linear& l, const double* H) {
  const std::size_t m = x_.size();
  HW_.assign(m, 0.0);
  for (std::size_t k = 0; k < l.dim; ++k) {
    if (H[k] == 0) continue;
    const double* W = &island_->W[m * (l.row + k)];
    for (std::size_t j = 0; j < m; ++j) HW_[j] += H[k] * W[j];
  }
  return HW_.data();
}

// dx of (G + H (W + proximal)) dx = -F. What is at its bound goes there; W times that is known.
bool SmallVi::solve_linear() {
  const std::size_t m = x_.size();
  active_.clear();
  std::fill(du_.begin(), du_.end(), 0.0);
  std::size_t rows = 0;
  for (std::size_t b = 0; b < linear_.size(); ++b) {
    const Linear& l = linear_[b];
    if (l.acts) {
      active_.push_back(b);
      rows += l.dim;
      continue;
    }
    for (std::size_t k = 0; k < l.dim; ++k) {
      const double d = dx_[l.row + k] = -l.F[k];
      if (d == 0) continue;
      const double* W = &island_->W[m * (l.row + k)];
      for (std::size_t j = 0; j < m; ++j) du_[j] += d * W[j];
    }
  }
  if (rows == 0) return true;
  const std::size_t stride = factor_stride(rows);
  J_.assign(rows * stride, 0.0);
  columns_.resize(rows * factor_columns);
  rhs_.resize(rows);
  std::size_t at = 0;
  for (std::size_t b : active_) {
    const Linear& l = linear_[b];
    for (std::size_t i = 0; i < l.dim; ++i, ++at) {
      double* J = &J_[stride * at];
      const double* H = &l.H[l.dim * i];
      double r = -l.F[i];
      for (std::size_t k = 0; k < l.dim; ++k) r -= H[k] * du_[l.row + k];
      rhs_[at] = r;
      const double* HW = product_row(l, H);
      std::size_t column = 0;
      for (std::size_t c : active_) {
        const Linear& other = linear_[c];
        for (std::size_t j = 0; j < other.dim; ++j, ++column) {
          J[column] = HW[other.row + j];
          if (b == c) J[column] += l.G[l.dim * i + j] + H[j] * sigma_ * p_[b];
        }
      }
    }
  }
  ++result_.factorizations;
  work_ += rows * rows * (rows + 9) / 3;
  pivots_.resize(rows);
  if (!AMONTONS_DISPATCH(factor_rows, J_.data(), pivots_.data(), rows, stride, columns_.data()) ||
      !AMONTONS_DISPATCH(solve_rows, J_.data(), pivots_.data(), rhs_.data(), rows, stride))
    return false;
  at = 0;
  for (std::size_t b : active_)
    for (std::size_t k = 0; k < linear_[b].dim; ++k) dx_[linear_[b].row + k] = rhs_[at++];
  return true;
}

}  // namespace amontons
