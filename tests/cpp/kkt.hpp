#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "amontons/problem/problem.hpp"

// The optimality conditions of both laws, written out per kind of row and independent of residual().
//
// Tolerances. Let e = x - Pi_K(x - g / P) be the natural map of a block, y = x - e and h = g - P e. Then y in
// K and -h in the normal cone of K at y exactly: x and g fulfil the conditions up to e and P e. A natural
// residual r means sum P |e|^2 = (r * scale)^2, so |e| <= delta / sqrt(P) and P |e| <= delta sqrt(P) with
// delta = r * scale.
namespace kkt {

using namespace amontons;
using Vector = std::vector<double>;

// An upper bound of the natural map at x = 0, the scale of the residual: |Pi_K(-g / P)| <= |g| / P + dist(0,
// K).
inline double scale_bound(const Problem& p, Law law) {
  double sum = 0;
  for_each_block(p.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    double g = 0, away = 0;
    for (int k = 0; k < S::dim; ++k) g += p.b[row + k] * p.b[row + k];
    g = std::sqrt(g);
    if constexpr (S::frictional) {
      if (law == Law::coulomb) g += set.de_saxce(&p.b[row]);
    }
    if constexpr (requires { set.lo; }) away = std::max({0.0, set.lo, -set.hi});
    const double e = g / p.P[block] + away;
    sum += p.P[block] * e * e;
  });
  return std::sqrt(sum);
}

inline std::string excess(const char* what, std::size_t row, double value, double bound) {
  if (value <= bound) return "";  // false for NaN
  return std::string(what) + " at row " + std::to_string(row) + ": " + std::to_string(value * 1e12) +
         "e-12 > " + std::to_string(bound * 1e12) + "e-12";
}

// x and u of one friction contact; e and Pe as above.
inline std::string contact(double mu, Law law, const double* x, const double* u, double e, double Pe,
                           std::size_t row) {
  const double x_t = std::hypot(x[1], x[2]), u_t = std::hypot(u[1], u[2]);
  const double g_n = law == Law::coulomb ? u[0] + mu * u_t : u[0];
  std::vector<std::string> found;
  const auto check = [&](const char* what, double value, double bound) {
    if (auto text = excess(what, row, value, bound); !text.empty()) found.push_back(text);
  };
  check("x outside the cone, |x_t| > mu x_n", x_t - mu * x[0], (1 + mu) * e);
  check("x_n negative", -x[0], e);
  const double g = std::hypot(g_n, u_t), size = std::hypot(x[0], x_t);
  const double work = g_n * x[0] + u[1] * x[1] + u[2] * x[2];
  const double work_bound = e * g + Pe * size + 3 * e * Pe;  // <y, h> = 0 with y = x - e, h = g - P e
  check("<x, g> not zero", std::abs(work), work_bound);
  if (law == Law::associated) {
    check("u outside the dual cone, mu |u_t| > u_n", mu * u_t - u[0], (1 + mu) * Pe);
  } else {
    check("penetration, u_n < 0", -u[0], (1 + mu) * Pe);
    // x_n u_n = <x, g> - (mu x_n |u_t| + x_t u_t), whose bracket is at least -(1 + mu) |e| |u_t|.
    check("x_n u_n not zero", x[0] * u[0], work_bound + (1 + mu) * e * u_t);
  }
  // Sliding: y_t = -mu y_n h_t / |h_t|, and unit vectors differ by 2 |h_t - u_t| / |u_t| at most.
  if (u_t > 0) {
    const double off = std::hypot(x[1] + mu * x[0] * u[1] / u_t, x[2] + mu * x[0] * u[2] / u_t);
    check("friction does not oppose the slip with mu x_n", off,
          (1 + mu) * e + 2 * mu * (std::abs(x[0]) + e) * Pe / u_t);
  }
  // Sticking: y inside the cone means h = 0.
  if (mu * x[0] - x_t > (1 + mu) * e) check("sticking contact moves", std::hypot(g_n, u_t), Pe);
  return found.empty() ? "" : found.front();
}

// The first condition that (x, u = A x + b) violates by more than a natural residual of `tolerance` allows;
// empty if there is none.
inline std::string violation(const Problem& p, Law law, double tolerance, const Vector& x) {
  Vector u(x.size());
  product(p.A, x, u);
  double size = 0;
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += p.b[i], size = std::max(size, std::abs(p.b[i]));
  // Forming u anew rounds differently: eps times what is summed up.
  const double delta = tolerance * scale_bound(p, law) + 1e-14 * size;
  std::string first;
  for_each_block(p.K, [&]<class S>(const S& set, std::size_t block, std::size_t row) {
    if (!first.empty()) return;
    const double e = delta / std::sqrt(p.P[block]), Pe = delta * std::sqrt(p.P[block]);
    const double *xi = &x[row], *ui = &u[row];
    if constexpr (std::is_same_v<S, Friction>) {
      first = contact(set.mu, law, xi, ui, e, Pe, row);
    } else if constexpr (std::is_same_v<S, Bilateral>) {
      first = excess("bilateral row moves", row, std::abs(*ui), Pe);
    } else if constexpr (S::dim == 1) {
      double lo = 0, hi = INFINITY;
      if constexpr (std::is_same_v<S, Interval>) lo = set.lo, hi = set.hi;
      first = excess("x outside its bounds", row, std::max(lo - *xi, *xi - hi), e);
      if (first.empty() && *xi - lo > e) first = excess("u > 0 above the lower bound", row, *ui, Pe);
      if (first.empty() && hi - *xi > e) first = excess("u < 0 below the upper bound", row, -*ui, Pe);
    }
  });
  return first;
}

}  // namespace kkt
