// Primal-dual interior point with Nesterov-Todd scaling and Mehrotra's predictor-corrector for
//
//     u = A x + b,  x in K,  u in K*,  x o u = 0,
//
// each Newton system reduced to (A + W^2) dx = r and solved by ShiftedSystem: in body space that is a sparse
// Cholesky factorisation with six unknowns per body. Sources: Nesterov, Todd 1997; Mehrotra 1992;
// Vandenberghe 2010 for the algebra. Friction cones become second-order cones by x^ = (mu x_n, x_t), u^ =
// (u_n / mu, u_t). Bilateral rows have W^2 = delta, a proximal term, since u = 0 there.
#include <algorithm>
#include <cmath>

#include "amontons/problem/residual.hpp"
#include "amontons/solvers/driver/chain.hpp"
#include "amontons/solvers/driver/monitor.hpp"
#include "amontons/solvers/linear/shifted_system.hpp"
#include "amontons/solvers/solvers.hpp"
#include "solvers/driver/phases.hpp"
#include "solvers/second_order/soc.hpp"

namespace amontons {

namespace {

using soc::V3;
using Vector = std::vector<double>;

constexpr double proximal = 1e-9;   // delta / P of bilateral rows
constexpr double fraction = 0.995;  // of the way to the boundary
// Iterations of the crossover. Under coulomb fewer of Newton's: the path may end away from any solution, and
// then more are in vain.
constexpr std::size_t newton_iterations = 30, coulomb_newton_iterations = 12, first_order_iterations = 20000;
// Where blocks are many the crossover is cut short, or it would take seconds for the last digits.
constexpr std::size_t few_blocks = 1000, many_newton_iterations = 8, many_first_order_work = 50'000'000;
constexpr double lost_path = 1e4;  // growth over the best residual that ends the path
constexpr double flat_mu = 1e-9;   // below, a friction cone is the half-line along its normal

enum class Role { free, ray, box, cone, dead };  // how a row, or the three rows of a contact, enters

class InteriorPoint {
 public:
  InteriorPoint(const Problem& problem, const Options& options, Monitor& monitor);

  double evaluate();  // forms x and A x + b; returns the natural map
  double objective() const;
  const Vector& x() const { return x_; }
  // Sets the De Saxce term mu |u_t| of every contact, constant within a step.
  void correct(const Vector& u);
  bool advance();  // one predictor-corrector step; false when no progress is possible

 private:
  // f(role, block, row, lo, hi); the bounds, scaled, for boxes only.
  template <class F>
  void each(F&& f) const;
  void choose_scales();
  void start();
  void factor();
  void solve(double sigma_mu, bool corrector, int refinements);
  void recover_step(double sigma_mu);
  double longest_step() const;
  double gap(double t) const;
  V3 at(const Vector& v, std::size_t row) const { return {v[row], v[row + 1], v[row + 2]}; }

  const Problem& problem_;
  const Options& options_;
  Monitor& monitor_;
  ShiftedSystem system_;
  double beta2_ = 1, degree_ = 0;
  // Scaled: x^ = x / scale, u^ = u scale / beta2. z_lo, z_hi: multipliers of the bounds of a box, u^ = z_lo -
  // z_hi.
  Vector scale_, x_hat_, u_hat_, z_lo_, z_hi_, dx_hat_, du_hat_, dz_lo_, dz_hi_, second_lo_, second_hi_, rho_,
      z_;
  Vector correction_;            // per block
  Vector x_, u_, rhs_, dx_, R_;  // true units; R_ holds the factors of the shifted system
  std::vector<soc::Scaling> scaling_;
};

InteriorPoint::InteriorPoint(const Problem& problem, const Options& options, Monitor& monitor)
    : problem_(problem), options_(options), monitor_(monitor), system_(problem) {
  for (Vector* v : {&scale_, &x_hat_, &u_hat_, &z_lo_, &z_hi_, &dx_hat_, &du_hat_, &dz_lo_, &dz_hi_,
                    &second_lo_, &second_hi_, &rho_, &z_, &x_, &u_, &rhs_, &dx_})
    v->assign(problem.rows(), 0.0);
  R_.resize(system_.factor_size());
  correction_.assign(problem.K.blocks(), 0.0);
  scaling_.resize(problem.K.blocks(), soc::Scaling({1, 0, 0}, {1, 0, 0}));
  choose_scales();
  start();
}

template <class F>
void InteriorPoint::each(F&& f) const {
  for_each_block(problem_.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
    if constexpr (std::is_same_v<Set, Friction>) {
      f(set.mu > flat_mu ? Role::cone : Role::ray, block, row, 0.0, 0.0);
    } else if constexpr (std::is_same_v<Set, Interval>) {
      const bool open = std::isinf(set.lo) && std::isinf(set.hi);
      f(open               ? Role::free
        : set.lo == set.hi ? Role::dead
                           : Role::box,
        block, row, set.lo / scale_[row], set.hi / scale_[row]);
    } else {
      f(std::is_same_v<Set, Free> ? Role::free : Role::ray, block, row, 0.0, 0.0);
    }
  });
}

// Rows in units of 1/sqrt(P), and all of them such that the natural map at zero is of order one.
void InteriorPoint::choose_scales() {
  double beta =
      natural_map_at_zero(problem_, options_.law) / std::sqrt(std::max<double>(1, problem_.K.blocks()));
  if (beta < 1e-290) beta = 1;
  beta2_ = beta * beta;
  for_each_block(problem_.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
    for (int k = 0; k < Set::dim; ++k) scale_[row + k] = beta / std::sqrt(problem_.P[block]);
    if constexpr (std::is_same_v<Set, Friction>)
      if (set.mu > flat_mu) scale_[row] /= set.mu;
  });
  each([&](Role role, std::size_t, std::size_t, double lo, double hi) {
    if (role == Role::cone || role == Role::ray) degree_ += 1;
    if (role == Role::box) degree_ += std::isfinite(lo) + std::isfinite(hi);
  });
}

// The solution of the problem without inequalities but with a unit proximal term, pushed into the interior.
void InteriorPoint::start() {
  std::fill(R_.begin(), R_.end(), 0.0);
  each([&](Role role, std::size_t block, std::size_t row, double lo, double hi) {
    double* R = &R_[system_.factor_offset(block)];
    const double beta = std::sqrt(beta2_);
    if (role == Role::free) R[0] = scale_[row] / beta / std::sqrt(proximal);
    if (role == Role::ray) R[0] = scale_[row] / beta;
    if (role == Role::cone)
      for (int k = 0; k < 3; ++k) R[4 * k] = scale_[row + k] / beta;
    if (role == Role::dead && std::isfinite(lo)) x_[row] = lo * scale_[row];
    if (role == Role::box) {
      x_hat_[row] = std::isfinite(lo) && std::isfinite(hi) ? 0.5 * (lo + hi)
                    : std::isfinite(lo)                    ? lo + 1
                                                           : hi - 1;
      x_[row] = x_hat_[row] * scale_[row];
      z_lo_[row] = std::isfinite(lo), z_hi_[row] = std::isfinite(hi);
    }
  });
  system_.factor(R_);
  ++monitor_.factorizations;
  evaluate();
  for (std::size_t i = 0; i < x_.size(); ++i) rhs_[i] = -u_[i];
  system_.solve(rhs_, dx_, 1);
  double low_x = INFINITY, low_u = INFINITY;  // smallest eigenvalue of x^ and of u^ = -x^
  each([&](Role role, std::size_t, std::size_t row, double, double) {
    if (role == Role::dead) x_hat_[row] = x_[row] / scale_[row];
    if (role == Role::dead || role == Role::box) return;
    for (int k = 0; k < (role == Role::cone ? 3 : 1); ++k) x_hat_[row + k] = dx_[row + k] / scale_[row + k];
    if (role == Role::free) return;
    for (int k = 0; k < (role == Role::cone ? 3 : 1); ++k) u_hat_[row + k] = -x_hat_[row + k];
    const double t = role == Role::cone ? soc::norm1(at(x_hat_, row)) : 0.0;
    low_x = std::min(low_x, x_hat_[row] - t);
    low_u = std::min(low_u, -x_hat_[row] - t);
  });
  each([&](Role role, std::size_t, std::size_t row, double, double) {
    if (role != Role::ray && role != Role::cone) return;
    if (low_x < 1e-3) x_hat_[row] += 1 - low_x;
    if (low_u < 1e-3) u_hat_[row] += 1 - low_u;
  });
}

double InteriorPoint::evaluate() {
  each([&](Role role, std::size_t, std::size_t row, double, double) {
    if (role == Role::dead) return;
    for (int k = 0; k < (role == Role::cone ? 3 : 1); ++k) x_[row + k] = scale_[row + k] * x_hat_[row + k];
  });
  product(problem_.A, x_, u_);
  ++monitor_.products;
  for (std::size_t i = 0; i < u_.size(); ++i) u_[i] += problem_.b[i];
  return natural_map(problem_, options_.law, x_, u_);
}

double InteriorPoint::objective() const {
  double f = 0;
  for (std::size_t i = 0; i < x_.size(); ++i) f += 0.5 * x_[i] * (u_[i] + problem_.b[i]);
  return f;
}

// Theta^-1 = beta^2 S^-1 W^2 S^-1, so R = S W^-1 / beta.
void InteriorPoint::factor() {
  const double beta = std::sqrt(beta2_);
  each([&](Role role, std::size_t block, std::size_t row, double lo, double hi) {
    double* R = &R_[system_.factor_offset(block)];
    if (role == Role::ray) R[0] = scale_[row] / beta * std::sqrt(x_hat_[row] / u_hat_[row]);
    if (role == Role::box) {
      const double w2 = z_lo_[row] / (x_hat_[row] - lo) + z_hi_[row] / (hi - x_hat_[row]);
      R[0] = scale_[row] / beta / std::sqrt(w2);
    }
    if (role == Role::cone) {
      scaling_[block] = soc::Scaling(at(u_hat_, row), at(x_hat_, row));
      for (int k = 0; k < 3; ++k) {
        const V3 column = scaling_[block].inverse_times({double(k == 0), double(k == 1), double(k == 2)});
        for (int i = 0; i < 3; ++i) R[3 * i + k] = scale_[row + i] / beta * column[i];
      }
    }
  });
  system_.factor(R_);
  ++monitor_.factorizations;
}

// The direction for  lambda o (W dx^ + W^-1 du^) = c = sigma mu e - lambda o lambda - (the affine
// second-order term), A dx - du = -(A x + b - u). With rho = lambda \\ c and z = W dx^ it is du^ = W (rho -
// z) and (I + R'AR) beta z = R'(-(A x + b - u)) + beta rho. Solving for z keeps both steps accurate where W
// or its inverse is huge; z_ holds z, rho_ rho.
void InteriorPoint::solve(double sigma_mu, bool corrector, int refinements) {
  each([&](Role role, std::size_t block, std::size_t row, double lo, double hi) {
    if (role == Role::ray) {
      const double lambda = std::sqrt(x_hat_[row] * u_hat_[row]);
      rho_[row] = (sigma_mu - (corrector ? dx_hat_[row] * du_hat_[row] : 0.0)) / lambda - lambda;
    }
    if (role == Role::box) {
      second_lo_[row] = corrector ? dx_hat_[row] * dz_lo_[row] : 0.0;
      second_hi_[row] = corrector ? -dx_hat_[row] * dz_hi_[row] : 0.0;
      double target = -u_hat_[row];
      if (std::isfinite(lo)) target += (sigma_mu - second_lo_[row]) / (x_hat_[row] - lo);
      if (std::isfinite(hi)) target -= (sigma_mu - second_hi_[row]) / (hi - x_hat_[row]);
      rho_[row] = target * std::sqrt(beta2_) * R_[system_.factor_offset(block)] / scale_[row];
    }
    if (role == Role::cone) {
      const soc::Scaling& W = scaling_[block];
      V3 c = soc::jordan(W.lambda, W.lambda);
      for (double& v : c) v = -v;
      c[0] += sigma_mu;
      if (corrector) {
        const V3 second = soc::jordan(W.inverse_times(at(du_hat_, row)), W.times(at(dx_hat_, row)));
        for (int k = 0; k < 3; ++k) c[k] -= second[k];
      }
      const V3 t = soc::jordan_divide(W.lambda, c);
      for (int k = 0; k < 3; ++k) rho_[row + k] = t[k];
    }
  });
  const double beta = std::sqrt(beta2_);
  for_each_block(problem_.K, [&]<class Set>(const Set&, std::size_t block, std::size_t row) {
    for (int k = 0; k < Set::dim; ++k) z_[row + k] = beta2_ / scale_[row + k] * u_hat_[row + k] - u_[row + k];
    z_[row] -= correction_[block];
  });
  system_.times_transposed_factor(z_, z_);
  for (std::size_t i = 0; i < z_.size(); ++i) z_[i] += beta * rho_[i];
  system_.solve_reduced(z_, z_, refinements);
  monitor_.products += 1 + refinements;
  for (double& v : z_) v /= beta;
  recover_step(sigma_mu);
}

void InteriorPoint::recover_step(double sigma_mu) {
  const double beta = std::sqrt(beta2_);
  each([&](Role role, std::size_t block, std::size_t row, double lo, double hi) {
    if (role == Role::cone) {
      const soc::Scaling& W = scaling_[block];
      const V3 z = at(z_, row), dx = W.inverse_times(z);
      const V3 du = W.times({rho_[row] - z[0], rho_[row + 1] - z[1], rho_[row + 2] - z[2]});
      for (int k = 0; k < 3; ++k) dx_hat_[row + k] = dx[k], du_hat_[row + k] = du[k];
      return;
    }
    const double inverse_w = beta * R_[system_.factor_offset(block)] / scale_[row];
    dx_hat_[row] = inverse_w * z_[row];
    if (role == Role::ray) du_hat_[row] = (rho_[row] - z_[row]) / inverse_w;
    if (role == Role::box) {
      const double s_lo = x_hat_[row] - lo, s_hi = hi - x_hat_[row];
      if (std::isfinite(lo))
        dz_lo_[row] = (sigma_mu - second_lo_[row] - z_lo_[row] * dx_hat_[row]) / s_lo - z_lo_[row];
      if (std::isfinite(hi))
        dz_hi_[row] = (sigma_mu - second_hi_[row] + z_hi_[row] * dx_hat_[row]) / s_hi - z_hi_[row];
      du_hat_[row] = dz_lo_[row] - dz_hi_[row];
    }
  });
}

double InteriorPoint::longest_step() const {
  double t = 1e30;
  const auto ray = [&](double v, double dv) {
    if (dv < 0) t = std::min(t, -v / dv);
  };
  each([&](Role role, std::size_t, std::size_t row, double lo, double hi) {
    if (role == Role::ray) ray(x_hat_[row], dx_hat_[row]), ray(u_hat_[row], du_hat_[row]);
    if (role == Role::box) {
      ray(x_hat_[row] - lo, dx_hat_[row]), ray(hi - x_hat_[row], -dx_hat_[row]);
      ray(z_lo_[row], dz_lo_[row]), ray(z_hi_[row], dz_hi_[row]);
    }
    if (role == Role::cone) {
      t = std::min(t, soc::step_to_boundary(at(x_hat_, row), at(dx_hat_, row)));
      t = std::min(t, soc::step_to_boundary(at(u_hat_, row), at(du_hat_, row)));
    }
  });
  return t;
}

// The complementarity <x, u> / degree at x + t dx, u + t du.
double InteriorPoint::gap(double t) const {
  double sum = 0;
  each([&](Role role, std::size_t, std::size_t row, double lo, double hi) {
    if (role == Role::box) {
      const double x = x_hat_[row] + t * dx_hat_[row];
      if (std::isfinite(lo)) sum += (x - lo) * (z_lo_[row] + t * dz_lo_[row]);
      if (std::isfinite(hi)) sum += (hi - x) * (z_hi_[row] + t * dz_hi_[row]);
    }
    if (role == Role::ray || role == Role::cone)
      for (int k = 0; k < (role == Role::cone ? 3 : 1); ++k)
        sum += (x_hat_[row + k] + t * dx_hat_[row + k]) * (u_hat_[row + k] + t * du_hat_[row + k]);
  });
  return sum / std::max(1.0, degree_);
}

void InteriorPoint::correct(const Vector& u) {
  for_each_block(problem_.K, [&]<class Set>(const Set& set, std::size_t block, std::size_t row) {
    if constexpr (std::is_same_v<Set, Friction>)
      correction_[block] = set.mu * std::sqrt(u[row + 1] * u[row + 1] + u[row + 2] * u[row + 2]);
  });
}

bool InteriorPoint::advance() {
  if (options_.law == Law::coulomb) {
    // From the dual iterate u^, which moves smoothly along the central path; A x + b is rough until the end.
    for (std::size_t i = 0; i < u_hat_.size(); ++i) rhs_[i] = beta2_ / scale_[i] * u_hat_[i];
    correct(rhs_);
  }
  factor();
  const double mu = gap(0);
  solve(0, false, 0);
  const double affine = std::min(1.0, longest_step());
  const double ratio = mu > 0 ? std::clamp(gap(affine) / mu, 0.0, 1.0) : 0.0;
  solve(ratio * ratio * ratio * mu, true, 1);
  const double t = std::min(1.0, fraction * longest_step());
  if (!(t > 1e-4)) return false;
  for (std::size_t i = 0; i < x_.size(); ++i) {
    x_hat_[i] += t * dx_hat_[i], u_hat_[i] += t * du_hat_[i];
    z_lo_[i] += t * dz_lo_[i], z_hi_[i] += t * dz_hi_[i];
  }
  return true;
}

}  // namespace

Solution central_path(const Problem& problem, const Options& options) {
  Monitor monitor(options, 200, 30);
  const double scale = natural_map_at_zero(problem, options.law);
  Vector best(problem.rows(), 0.0), u(problem.rows());
  const double start = starting_point(problem, options, best, u, monitor);
  Status status = Status::stalled;
  if (start <= options.tolerance)
    return finish(problem, options, "interior-point", std::move(best), status, monitor);
  InteriorPoint method(problem, options, monitor);
  for (;;) {
    const double r = method.evaluate() / scale;
    const auto stop = monitor.observe(r, method.objective());
    if (monitor.improved() && r < start) best = method.x();
    if (stop) {
      status = *stop;
      break;
    }
    // Rounding ends the central path: the residual leaps off, or the step collapses.
    if (r > lost_path * std::max(monitor.best(), 1e-12) || !method.advance()) break;
  }
  return finish(problem, options, "interior-point", std::move(best), status, monitor);
}

// Contacts between two faces (sliding and sticking, open and closed) hold the central path at sqrt(eps) of
// the solution. From there the semismooth Newton method identifies the faces and goes on to the last digits;
// where it cannot, P-SPG-FB does.
Solution interior_point(const Problem& problem, const Options& options) {
  const std::size_t blocks = problem.K.blocks();
  const std::size_t newtons = blocks > few_blocks           ? many_newton_iterations
                              : options.law == Law::coulomb ? coulomb_newton_iterations
                                                            : newton_iterations;
  const std::size_t first_order =
      std::min(first_order_iterations, many_first_order_work / std::max<std::size_t>(blocks, 1));
  Solution s = run_phases(problem, options,
                          {{central_path}, {newton, newtons}, {spg, std::max<std::size_t>(first_order, 1)}});
  s.method = "interior-point";
  return s;
}

}  // namespace amontons
