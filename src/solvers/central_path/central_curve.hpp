#pragma once
#include <algorithm>
#include <cmath>
#include <span>
#include <type_traits>
#include <vector>

#include "amontons/base/elementary.hpp"
#include "amontons/problem/residual.hpp"
#include "amontons/sets/barriers.hpp"
#include "solvers/central_path/near_point.hpp"
#include "solvers/central_path/policy.hpp"

namespace amontons {

// The central path of Coulomb's law as a curve, docs/algorithm.md (34): with the dual iterate w and u = A x +
// b, for t from 1 down to 0
//
//     F = w - u - s_t(w) e_n - t r = 0,   x o w = t e     (x in K, w in its dual; o the Jordan product),
//
// where s_t = sqrt(s^2 + (rounding t)^2) is the De Saxce term at w with its kink rounded off, and r is F at
// the start. The limit t = 0 is the law. For every t > 0 all is smooth inside the sets, but the problem is
// not monotone. The curve has folds at which t rises again for a while, so t cannot be its parameter. The
// curve is followed by its length. The sign of the determinant of Newton's matrix changes at every fold and
// decides whether t must fall or rise (Allgower, Georg, "Numerical continuation methods", 1990, chapter 3). A
// curve from a generic start ends at a solution or diverges (Chow, Mallet-Paret, Yorke 1978).
//
// In the scaled coordinates of the barriers (sets/barrier.hpp), dx = R z, dw = T (rho - z) with T = R^-T, a
// step is
//
//     (B T + A R) z = F + B T rho,   B = dF/dw = I - e_n g', g the gradient of s_t.
//
// det R, det T > 0 and det B = 1, so this sign is that of the matrix of the linear system, or of R' times it.
//
// System, in units in which A and b are of order one:
//   units().of_x()                      impulse unit per block (N s), which scales the bounds of intervals
//   size_t offset(block), size()        layout of the row-major matrices of the blocks, dim^2 each
//   product(x, u)                       u = A x + b
//   int factor(R, BT)                   factors B T + A R; the sign of its determinant, 0 if it fails
//   solve(q, z, refinements)            false if z is not finite; q may be z
template <class System>
class CentralCurve {
 public:
  // Starts in the middle of the sets. The system and K must outlive it.
  void start(System& system, const SetProduct& K, Law law);
  // Starts at the point with x o w = t e whose x - w is that of the given x and u, in the units of the
  // system. The nearer these are to a solution, the smaller t may be. False for sets without such a point.
  bool start_near(System& system, const SetProduct& K, Law law, std::span<const double> x,
                  std::span<const double> u, double t);
  // One step along the curve or back to it, with one factorisation; false if no step is possible.
  bool step();
  // The current x, inside the sets, in the units of the system.
  void x(std::span<double> out);
  // Curve parameter: 1 in the middle of the sets, 0 at the solution.
  double t() const { return t_; }

 private:
  // z and rho of a direction, and the relative change of t along it.
  struct Direction {
    std::vector<double> z, rho;
    double dt = 0;
  };
  template <class F>
  void each(F&& f) {
    barriers_.each(*K_, f);
  }
  void linearise();
  void target(double mu, bool corrector, std::vector<double>& rho);
  bool solve(std::span<const double> F, Direction& d, int refinements);
  void add(Direction& to, double factor, const Direction& d) const;
  double inner(const Direction& a, const Direction& b) const;
  double norm(const Direction& d) const { return std::sqrt(inner(d, d)); }
  double largest(const Direction& d) const;
  void recover(const Direction& d, bool corrector);
  double longest_step(const Direction& d);
  bool bend(Direction& d);
  bool find_directions();
  double first_part(bool falls);
  bool back();
  bool move(const Direction& d, double share);
  bool shorten();
  void go(double t, double dt, double step);

  System* system_ = nullptr;
  const SetProduct* K_ = nullptr;
  Law law_{};
  Barriers barriers_;
  double t_ = 1, first_t_ = 1;
  // Signs of the determinant: at the start, and where the last step along the curve began.
  int first_sign_ = 0, sign_before_ = 0;
  // The start of the last step along the curve: the point, the direction and the share of it that was taken.
  // Then t, and its relative change along the whole direction. Then the number of steps back to the curve
  // since.
  Barriers before_;
  double t_before_ = 1, dt_ = 0, step_ = 0;
  int back_steps_ = 0;
  // Marks the rows that count in lengths: not free rows and not rows without room.
  std::vector<char> counts_;
  std::vector<double> R_, BT_;
  // F, its value at the start, its derivative in log t.
  std::vector<double> F_, F_start_, F_t_, bent_, x_, u_, rho_;
  Direction back_, along_, trial_, corrected_;
};

namespace curve {

// A full step leaves that share of the distance to the boundary.
inline double least_share() { return 1 - policy.most_fraction; }
// Also for a step that is no number.
inline bool makes_no_progress(double step) { return !(step > least_share()); }

}  // namespace curve

template <class System>
bool CentralCurve<System>::start_near(System& system, const SetProduct& K, Law law,
                                      std::span<const double> x0, std::span<const double> u0, double t) {
  start(system, K, law);
  bool all = true;
  each([&]<class S>(const S& set, auto& barrier, std::size_t block, std::size_t row) {
    double g[S::dim];
    add_de_saxce_term(set, law, &u0[row], g);
    if constexpr (std::is_same_v<S, Interval>)
      curve::start_near(barrier, set, system.units().of_x()[block], &x0[row], g, t);
    else if constexpr (requires { curve::start_near(barrier, &x0[row], g, t); })
      curve::start_near(barrier, &x0[row], g, t);
    else
      all = false;
  });
  if (!all) return false;
  t_ = t_before_ = first_t_ = t;
  std::fill(F_start_.begin(), F_start_.end(), 0.0);
  linearise();
  F_start_ = F_;
  return true;
}

template <class System>
void CentralCurve<System>::start(System& system, const SetProduct& K, Law law) {
  system_ = &system;
  K_ = &K;
  law_ = law;
  t_ = t_before_ = first_t_ = 1;
  first_sign_ = sign_before_ = back_steps_ = 0;
  step_ = 0;
  const std::size_t m = K.rows();
  for (std::vector<double>* v : {&F_, &F_start_, &F_t_, &bent_, &x_, &u_, &rho_}) v->assign(m, 0.0);
  for (Direction* d : {&back_, &along_, &trial_, &corrected_}) {
    d->z.assign(m, 0.0);
    d->rho.assign(m, 0.0);
  }
  for (std::vector<double>* v : {&R_, &BT_}) v->assign(system.size(), 0.0);
  counts_.assign(m, 1);
  barriers_.make(K, system.units().of_x());
  each([&]<class S>(const S&, auto& barrier, std::size_t, std::size_t) {
    const double zero[S::dim] = {};
    barrier.start(zero);
    barrier.push(1, 1);
  });
  linearise();
  for_each_block(K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    const double* R = &R_[system.offset(block)];
    for (int k = 0; k < S::dim; ++k)
      counts_[row + k] = !std::is_same_v<S, Bilateral> && R[(S::dim + 1) * k] != 0;
  });
  F_start_ = F_;
}

template <class System>
void CentralCurve<System>::x(std::span<double> out) {
  each([&](const auto&, auto& barrier, std::size_t, std::size_t row) { barrier.primal(&out[row]); });
}

// F and its derivative in log t; R and B T of each block.
template <class System>
void CentralCurve<System>::linearise() {
  x(x_);
  system_->product(x_, u_);
  each([&]<class S>(const S& set, auto& barrier, std::size_t block, std::size_t row) {
    constexpr int d = S::dim;
    double *BT = &BT_[system_->offset(block)], w[d];
    barrier.factor(&R_[system_->offset(block)]);
    barrier.dual_factor(BT);
    barrier.dual(w);
    for (int k = 0; k < d; ++k) {
      F_t_[row + k] = -t_ / first_t_ * F_start_[row + k];
      F_[row + k] = w[k] - u_[row + k] + F_t_[row + k];
    }
    if constexpr (S::frictional) {
      if (law_ != Law::coulomb || !set.has_friction()) return;
      const double epsilon = curve::policy.rounding * t_, s = set.de_saxce(w),
                   rounded = elementary::hypot(s, epsilon);
      F_[row] -= rounded;
      F_t_[row] -= epsilon * epsilon / rounded;
      if (!(s > 0)) return;
      double g[d];
      set.de_saxce_gradient(w, g);
      for (int j = 0; j < d; ++j)
        for (int k = 1; k < d; ++k) BT[j] -= s / rounded * g[k] * BT[d * k + j];
    }
  });
}

template <class System>
void CentralCurve<System>::target(double mu, bool corrector, std::vector<double>& rho) {
  each([&](const auto&, auto& barrier, std::size_t, std::size_t row) {
    barrier.target(mu, corrector, &rho[row]);
  });
}

// z of (B T + A R) z = F + B T rho.
template <class System>
bool CentralCurve<System>::solve(std::span<const double> F, Direction& d, int refinements) {
  for_each_block(*K_, [&]<class S>(const S&, std::size_t block, std::size_t row) {
    const double* BT = &BT_[system_->offset(block)];
    for (int i = 0; i < S::dim; ++i) {
      double sum = F[row + i];
      for (int k = 0; k < S::dim; ++k) sum += BT[S::dim * i + k] * d.rho[row + k];
      d.z[row + i] = sum;
    }
  });
  return system_->solve(d.z, d.z, refinements);
}

template <class System>
void CentralCurve<System>::add(Direction& to, double factor, const Direction& d) const {
  for (std::size_t i = 0; i < to.z.size(); ++i) {
    to.z[i] += factor * d.z[i];
    to.rho[i] += factor * d.rho[i];
  }
  to.dt += factor * d.dt;
}

// Inner product in the metric of the barriers on the curve, where x and w are sqrt(t) e in scaled
// coordinates. It measures the relative changes of x, w and t.
template <class System>
double CentralCurve<System>::inner(const Direction& a, const Direction& b) const {
  double sum = 0;
  for (std::size_t i = 0; i < a.z.size(); ++i)
    if (counts_[i]) sum += a.z[i] * b.z[i] + (a.rho[i] - a.z[i]) * (b.rho[i] - b.z[i]);
  return sum / t_ + a.dt * b.dt;
}

// Length of the part of the direction in one block.
template <class System>
double CentralCurve<System>::largest(const Direction& d) const {
  double most = 0;
  for_each_block(*K_, [&]<class S>(const S&, std::size_t, std::size_t row) {
    double sum = 0;
    for (std::size_t i = row; i < row + S::dim; ++i)
      if (counts_[i]) sum += d.z[i] * d.z[i] + (d.rho[i] - d.z[i]) * (d.rho[i] - d.z[i]);
    most = std::max(most, sum);
  });
  return std::sqrt(most / t_);
}

// Writes the direction to the barriers.
template <class System>
void CentralCurve<System>::recover(const Direction& d, bool corrector) {
  const double mu = t_ * (1 + d.dt);
  target(mu, corrector, rho_);
  each([&](const auto&, auto& barrier, std::size_t, std::size_t row) { barrier.recover(mu, &d.z[row]); });
}

// Largest share of the direction in the barriers that keeps x and w inside their sets and t above zero.
template <class System>
double CentralCurve<System>::longest_step(const Direction& d) {
  double share = d.dt < 0 ? -1 / d.dt : INFINITY;
  each([&](const auto&, auto& barrier, std::size_t, std::size_t) {
    share = std::min(share, barrier.longest_step());
  });
  return share;
}

// Error of F and of the products x o w at the end of the direction in the barriers. The correction across the
// curve that removes this error is stored in corrected_.
template <class System>
bool CentralCurve<System>::bend(Direction& d) {
  bent_ = F_;
  for (std::size_t i = 0; i < bent_.size(); ++i) bent_[i] += d.dt * F_t_[i];
  each([&]<class S>(const S& set, auto& barrier, std::size_t, std::size_t row) {
    if constexpr (S::frictional) {
      if (law_ != Law::coulomb || !set.has_friction()) return;
      constexpr int n = S::dim;
      double w[n], end[n], g[n];
      barrier.dual(w);
      barrier.dual(end, 1);
      const double epsilon = curve::policy.rounding * t_, s = set.de_saxce(w),
                   rounded = elementary::hypot(s, epsilon);
      double linear = rounded + d.dt * epsilon * epsilon / rounded;
      if (s > 0) {
        set.de_saxce_gradient(w, g);
        for (int k = 1; k < n; ++k) linear += s / rounded * g[k] * (end[k] - w[k]);
      }
      bent_[row] -= elementary::hypot(set.de_saxce(end), epsilon * (1 + d.dt)) - linear;
    }
  });
  corrected_.dt = d.dt;
  target(t_ * (1 + d.dt), true, corrected_.rho);
  if (!solve(bent_, corrected_, 1)) return false;
  add(corrected_, -1, d);
  add(corrected_, -inner(corrected_, along_) / inner(along_, along_), along_);
  return true;
}

// A step back to the curve. If such steps do not reach it soon, the last step along it was too long.
template <class System>
bool CentralCurve<System>::back() {
  if (++back_steps_ > curve::policy.most_repeats && step_ > 0) return shorten();
  const double step = std::min(1.0, curve::policy.fraction * longest_step(back_));
  if (curve::makes_no_progress(step)) return false;
  go(t_, back_.dt, step);
  return true;
}

template <class System>
bool CentralCurve<System>::move(const Direction& d, double share) {
  step_ = std::min(1.0, share * longest_step(d));
  if (curve::makes_no_progress(step_)) return false;
  before_ = barriers_;
  t_before_ = t_;
  dt_ = d.dt;
  go(t_, dt_, step_);
  return true;
}

// Repeats the last step along the curve with half of its length.
template <class System>
bool CentralCurve<System>::shorten() {
  step_ *= curve::policy.most_change;
  if (curve::makes_no_progress(step_)) return false;
  back_steps_ = 0;
  barriers_ = before_;
  go(t_before_, dt_, step_);
  return true;
}

template <class System>
void CentralCurve<System>::go(double t, double dt, double step) {
  each([&](const auto&, auto& barrier, std::size_t, std::size_t) { barrier.move(step); });
  t_ = t * (1 + step * dt);
}

// Two directions: along_ follows the curve, back_ returns to it. back_ is solved with t held, then made
// orthogonal to along_, within the limit on the fall of t.
template <class System>
bool CentralCurve<System>::find_directions() {
  target(t_, false, back_.rho);
  target(0, false, along_.rho);
  for (std::size_t i = 0; i < rho_.size(); ++i) along_.rho[i] = back_.rho[i] - along_.rho[i];
  back_.dt = 0;
  along_.dt = 1;
  if (!solve(F_, back_, 0) || !solve(F_t_, along_, 0)) return false;
  const double speed = norm(along_);
  add(back_, std::max(-curve::policy.most_change, -inner(back_, along_) / (speed * speed)), along_);
  recover(back_, false);
  return true;
}

// Factor of t that a step aims at first, from the length of the direction that stays inside (Mehrotra). It
// leaves at least as much of t as a step leaves of the distance to the boundary. It is not positive if no
// step is possible.
template <class System>
double CentralCurve<System>::first_part(bool falls) {
  namespace c = curve;
  trial_ = back_;
  add(trial_, falls ? -1 : 1, along_);
  recover(trial_, false);
  const double free = std::min(1.0, longest_step(trial_)), rest = 1 - free;
  const double part = falls ? 1 - std::max(rest * rest * rest, c::least_share()) : c::policy.most_change;
  return std::min(part, free / c::policy.most_change);
}

template <class System>
bool CentralCurve<System>::step() {
  namespace c = curve;
  linearise();
  const int sign = system_->factor(R_, BT_);
  if (sign == 0) return false;
  if (first_sign_ == 0) first_sign_ = sign_before_ = sign;
  if (sign != sign_before_ && t_ < c::policy.most_change * t_before_) return shorten();
  if (!find_directions()) return false;
  if (largest(back_) > c::policy.neighbourhood) return back();
  back_steps_ = 0;
  sign_before_ = sign;
  const bool falls = sign == first_sign_;
  const double speed = norm(along_);
  double part = first_part(falls);
  if (!(part > 0)) return false;
  for (int i = 0;; ++i, part *= c::policy.most_change) {
    trial_ = back_;
    add(trial_, falls ? -part : part, along_);
    recover(trial_, false);
    if (!bend(trial_)) return false;
    const double share = norm(corrected_) / (part * speed);
    const bool bends = share > curve::policy.most_bend;
    const bool last = i == c::policy.most_repeats, straight = last && bends;
    if (!straight) add(trial_, 1, corrected_);
    recover(trial_, !straight);
    if (last || (!bends && longest_step(trial_) > c::policy.most_change))
      return move(trial_, std::clamp(1 - share, curve::policy.fraction, curve::policy.most_fraction));
  }
}

}  // namespace amontons
