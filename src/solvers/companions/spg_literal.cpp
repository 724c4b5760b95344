// P-SPG-FB as published: A. Tasora, "Efficient simulation of contacts, friction and constraints using a
// modified spectral projected gradient method", WSCG 2013, with every parameter of the paper exposed. The
// line search compares values of the objective, and each trial point costs a product. The fallback keeps the
// iterate with the smallest projected gradient at scale tau_g:
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
#include <numeric>

#include "amontons/solvers/driver/driver.hpp"

namespace amontons {

namespace {

using Vector = std::vector<double>;

// Ends the loop when rounding decides the test; lambda is then between sigma_min^60 and sigma_max^60.
constexpr std::size_t max_backtracks = 60;

double dot(const Vector& a, const Vector& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

// out = Pi_K(x - t g) - x
void projected_step(const SetProduct& K, const Vector& x, double t, const Vector& g, Vector& out) {
  for (std::size_t i = 0; i < x.size(); ++i) out[i] = x[i] - t * g[i];
  project(K, out, out);
  for (std::size_t i = 0; i < x.size(); ++i) out[i] -= x[i];
}

// The numbers at the lines are the steps of the algorithm above. g is u with the De Saxce term of the law.
class SpgLiteral : public VectorIterate {
 public:
  static constexpr const char* name = "p-spg-fb-literal";
  static constexpr Limits limits{100000, 100000, 0};

  SpgLiteral(const Problem& p, const Options& o, Monitor& m)
      : VectorIterate(p, o, m), o_(o.spg), P_(p.rows()) {
    for (Vector* v : {&g_, &p_, &d_, &x_next_, &u_next_, &g_next_, &trial_}) v->resize(p.rows());
    for_each_block(problem.K, [&]<class S>(const S&, std::size_t block, std::size_t row) {
      for (int k = 0; k < S::dim; ++k) P_[row + k] = problem.P[block];
    });
  }

  double start(const Start& s) {
    start_map_ = fallback_map_ = VectorIterate::start(s);
    x_FB_ = x;
    gradient(x, u, g_);
    f_ = objective_at(x, u);
    recent_.assign(o_.memory + 1, -INFINITY);  // f_{j-i} for i = 0 .. N_GLL
    recent_[0] = f_;
    return natural_map(problem, law_of(problem, options), x, u);
  }

  std::optional<double> step() {
    for (std::size_t i = 0; i < x.size(); ++i) p_[i] = g_[i] / P_[i];
    projected_step(problem.K, x, alpha_, p_, d_);  // 1
    double dg = dot(d_, g_);
    if (dg >= 0) {  // 2: the unpreconditioned direction
      projected_step(problem.K, x, alpha_, g_, d_);
      dg = dot(d_, g_);
    }
    const double f_next = line_search(dg);   // 3, 4
    double sPs = 0, sy = 0, yPy = 0, w = 0;  // 5
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double s = x_next_[i] - x[i], y = g_next_[i] - g_[i];
      sPs += P_[i] * s * s;
      sy += s * y;
      yPy += y * y / P_[i];
    }
    const double next = j_ % 2 ? sPs / sy : sy / yPy;  // 6
    alpha_ = std::clamp(sy > 0 ? next : o_.alpha_max, o_.alpha_min, o_.alpha_max);
    projected_step(problem.K, x_next_, o_.tau_g, g_next_, trial_);  // 7
    for (double v : trial_) w += (v / o_.tau_g) * (v / o_.tau_g);
    x.swap(x_next_);
    u.swap(u_next_);
    g_.swap(g_next_);
    f_ = f_next;
    recent_[++j_ % recent_.size()] = f_;
    const double map = natural_map(problem, law_of(problem, options), x, u);
    if (std::sqrt(w) <= w_best_) {
      w_best_ = std::sqrt(w);
      x_FB_ = x;
      fallback_map_ = map;
    }
    last_map_ = map;
    return map;
  }

  // The fallback of the paper is chosen by its own measure. But a solve must return an iterate that
  // converged, and never a worse one than its start.
  void keep_best() {
    kept = x;
    kept_map_ = last_map_;
  }
  void best(Vector& out) const {
    const double scale = natural_map_at_zero(problem, law_of(problem, options));
    if (kept_map_ <= options.tolerance * scale)
      out = kept;
    else if (fallback_map_ <= start_map_)
      out = x_FB_;
  }
  double objective() const { return f_; }
  double step_size() const { return alpha_; }
  std::size_t backtracks() const { return backtracks_; }

 private:
  // g = A x + b; under coulomb the De Saxce correction is refreshed at every evaluation.
  void gradient(const Vector& point, Vector& point_u, Vector& point_g) {
    amontons::evaluate(problem, law_of(problem, options), point, point_u, monitor);
    for_each_block(problem.K, [&](const auto& set, std::size_t, std::size_t row) {
      add_de_saxce_term(set, law_of(problem, options), &point_u[row], &point_g[row]);
    });
  }
  // 1/2 x'Ax + x'b, the correction (g - u) of the current iterate counted as part of b
  double objective_at(const Vector& point, const Vector& point_u) const {
    double f = 0;
    for (std::size_t i = 0; i < point.size(); ++i)
      f += point[i] * (0.5 * (point_u[i] + problem.b[i]) + g_[i] - u[i]);
    return f;
  }

  double line_search(double dg) {
    const double f_max = *std::max_element(recent_.begin(), recent_.end());
    // Under coulomb, f is a sum of differences, each with the correction of its iterate: with the correction
    // of the trial point -d need not be a direction of ascent. Under associated the shift is exactly zero.
    const double shift = f_ - objective_at(x, u);
    double lambda = 1;
    for (backtracks_ = 0;; ++backtracks_) {
      for (std::size_t i = 0; i < x.size(); ++i) x_next_[i] = x[i] + lambda * d_[i];
      gradient(x_next_, u_next_, g_next_);
      const double f_next = objective_at(x_next_, u_next_) + shift;
      if (f_next <= f_max + o_.gamma * lambda * dg || backtracks_ == max_backtracks) return f_next;
      // The minimum of the parabola with value f and slope <d, g> at 0 and value f_next at lambda.
      const double minimum = -lambda * lambda * dg / (2 * (f_next - f_ - lambda * dg));
      lambda =
          std::clamp(std::isfinite(minimum) ? minimum : 0.0, o_.sigma_min * lambda, o_.sigma_max * lambda);
    }
  }

  const SpgOptions& o_;
  // P_: mass of every row. recent_: ring of the last N_GLL + 1 objectives, f_j at j modulo its length.
  Vector P_, g_, p_, d_, x_next_, u_next_, g_next_, x_FB_, trial_, recent_;
  double alpha_ = 1, f_ = 0, w_best_ = 1e29;
  // Natural maps of the start, the current iterate, x_FB_ and the best iterate.
  double start_map_ = 0, last_map_ = 0, fallback_map_ = 0, kept_map_ = INFINITY;
  std::size_t backtracks_ = 0, j_ = 0;
};

}  // namespace

Solution spg_literal(const Problem& problem, const Options& options, Budget& budget) {
  return complete(drive<SpgLiteral>(problem, options, budget));
}

}  // namespace amontons
