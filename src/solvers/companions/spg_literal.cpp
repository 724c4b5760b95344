// P-SPG-FB as published: A. Tasora, "Efficient simulation of contacts, friction and constraints using a
// modified spectral projected gradient method", WSCG 2013, with every parameter of the paper exposed. Values
// of the objective are compared, each trial point costs a product, and the fallback keeps the iterate with
// the smallest projected gradient at scale tau_g:
//
//   x_0 := Pi_K(x_0); x_FB := x_0; alpha_0; g_0 := A x_0 + b; f_0 := 1/2 x_0'A x_0 + x_0'b; w := 1e29
//   for j = 0 .. N_max
//     1.  p := P^-1 g_j;  d := Pi_K(x_j - alpha_j p) - x_j
//     2.  if <d, g_j> >= 0:  d := Pi_K(x_j - alpha_j g_j) - x_j
//     3.  lambda := 1
//     4.  repeat  x+ := x_j + lambda d;  g+ := A x+ + b;  f+ := 1/2 x+'A x+ + x+'b
//           if f+ > max_{i = 0 .. min(j, N_GLL)} f_{j-i} + gamma lambda <d, g_j>
//             lambda := the quadratic interpolant, in [sigma_min lambda, sigma_max lambda];  else stop
//     5.  s := x+ - x_j;  y := g+ - g_j
//     6.  alpha := <s, P s> / <s, y> for odd j, <s, y> / <y, P^-1 y> for even j, in [alpha_min, alpha_max]
//     7.  w := |[x+ - Pi_K(x+ - tau_g g+)] / tau_g|;  if w <= all earlier w:  x_FB := x+
#include "amontons/solvers/companions/spg_literal.hpp"

#include <algorithm>
#include <cmath>

#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

namespace {

using Vector = std::vector<double>;

constexpr std::size_t max_backtracks = 60;

double dot(const Vector& a, const Vector& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// out = Pi_K(x - t g) - x
void projected_step(const SetProduct& K, const Vector& x, double t, const Vector& g, Vector& out) {
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = x[i] - t * g[i];
  project(K, out, out);
  for (std::size_t i = 0; i < x.size(); ++i) out[i] -= x[i];
}

class SpgLiteral {
 public:
  static constexpr const char* name = "p-spg-fb-literal";
  static constexpr Limits limits{100000, 100000, 0};

  SpgLiteral(const Problem& problem, const Options& options, Monitor& monitor)
      : problem_(problem), options_(options), o_(options.spg), monitor_(monitor), P_(problem.rows()) {
    for (Vector* v : {&u_, &g_, &p_, &d_, &x_next_, &u_next_, &g_next_, &trial_}) v->resize(problem.rows());
    for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      for (int k = 0; k < S::dim; ++k) P_[row + k] = problem.P[block];
    });
  }

  double start(const Start& s) {
    x_ = x_FB_ = s.x;
    start_map_ = fallback_map_ = s.map;
    gradient(x_, u_, g_);
    f_ = objective_at(x_, u_);
    recent_.assign(o_.memory + 1, -INFINITY);  // f_{j-i} for i = 0 .. N_GLL
    recent_[0] = f_;
    return natural_map(problem_, options_.law, x_, u_);
  }

  std::optional<double> step() {
    for (std::size_t i = 0; i < x_.size(); ++i) p_[i] = g_[i] / P_[i];
    projected_step(problem_.K, x_, alpha_, p_, d_);  // 1
    double dg = dot(d_, g_);
    if (dg >= 0) {  // 2: the unpreconditioned direction
      projected_step(problem_.K, x_, alpha_, g_, d_);
      dg = dot(d_, g_);
    }
    const double f_next = line_search(dg);   // 3, 4
    double sPs = 0, sy = 0, yPy = 0, w = 0;  // 5
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double s = x_next_[i] - x_[i], y = g_next_[i] - g_[i];
      sPs += P_[i] * s * s;
      sy += s * y;
      yPy += y * y / P_[i];
    }
    const double next = j_ % 2 ? sPs / sy : sy / yPy;  // 6
    alpha_ = std::clamp(sy > 0 ? next : o_.alpha_max, o_.alpha_min, o_.alpha_max);
    projected_step(problem_.K, x_next_, o_.tau_g, g_next_, trial_);  // 7
    for (double v : trial_) w += (v / o_.tau_g) * (v / o_.tau_g);
    x_.swap(x_next_);
    u_.swap(u_next_);
    g_.swap(g_next_);
    f_ = f_next;
    recent_[++j_ % recent_.size()] = f_;
    const double map = natural_map(problem_, options_.law, x_, u_);
    if (std::sqrt(w) <= w_best_) {
      w_best_ = std::sqrt(w);
      x_FB_ = x_;
      fallback_map_ = map;
    }
    last_map_ = map;
    return map;
  }

  double refresh() { return last_map_; }
  // The fallback of the paper is chosen by its own measure; but a solve returns what has converged, and no
  // less than it was given.
  void keep_best() { kept_ = x_, kept_map_ = last_map_; }
  void best(Vector& x) const {
    const double scale = natural_map_at_zero(problem_, options_.law);
    if (kept_map_ <= options_.tolerance * scale)
      x = kept_;
    else if (fallback_map_ <= start_map_)
      x = x_FB_;
  }
  void last(Vector& x) const { x = x_; }
  double objective() const { return f_; }
  double step_size() const { return alpha_; }
  std::size_t backtracks() const { return backtracks_; }

 private:
  // g = A x + b, and under coulomb the De Saxce correction refreshed at every evaluation.
  void gradient(const Vector& point, Vector& point_u, Vector& point_g) {
    evaluate(problem_, options_.law, point, point_u, monitor_);
    for_each_block(problem_.K, [&](const auto& set, std::size_t, std::size_t row) {
      add_saxce_term(set, options_.law, &point_u[row], &point_g[row]);
    });
  }
  // 1/2 x'Ax + x'b, the correction (g - u) of the current iterate counted as part of b
  double objective_at(const Vector& point, const Vector& point_u) const {
    double f = 0;
    for (std::size_t i = 0; i < point.size(); ++i)
      f += point[i] * (0.5 * (point_u[i] + problem_.b[i]) + g_[i] - u_[i]);
    return f;
  }

  double line_search(double dg) {
    const double f_max = *std::max_element(recent_.begin(), recent_.end());
    // Under coulomb, f is a sum of differences with the correction of each iterate: with the correction of
    // the trial point -d need not be a direction of ascent. Under associated the shift is exactly zero.
    const double shift = f_ - objective_at(x_, u_);
    double lambda = 1;
    for (backtracks_ = 0;; ++backtracks_) {
      for (std::size_t i = 0; i < x_.size(); ++i) x_next_[i] = x_[i] + lambda * d_[i];
      gradient(x_next_, u_next_, g_next_);
      const double f_next = objective_at(x_next_, u_next_) + shift;
      if (f_next <= f_max + o_.gamma * lambda * dg || backtracks_ == max_backtracks) return f_next;
      const double minimum = -lambda * lambda * dg / (2 * (f_next - f_ - lambda * dg));
      lambda =
          std::clamp(std::isfinite(minimum) ? minimum : 0.0, o_.sigma_min * lambda, o_.sigma_max * lambda);
    }
  }

  const Problem& problem_;
  const Options& options_;
  const SpgOptions& o_;
  Monitor& monitor_;
  Vector P_, x_, u_, g_, p_, d_, x_next_, u_next_, g_next_, x_FB_, trial_, recent_, kept_;
  double alpha_ = 1, f_ = 0, w_best_ = 1e29;
  double start_map_ = 0, last_map_ = 0, fallback_map_ = 0, kept_map_ = INFINITY;
  std::size_t backtracks_ = 0, j_ = 0;
};

}  // namespace

Solution spg_literal(const Problem& problem, const Options& options) {
  return drive<SpgLiteral>(problem, options);
}

}  // namespace amontons
