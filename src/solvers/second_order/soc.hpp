#pragma once
#include <array>
#include <cmath>
#include <limits>

// The second-order cone L3 = { (s0, s1) : |s1| <= s0 } as a symmetric cone: what an interior point needs of
// it. Notation of Vandenberghe, "The CVXOPT linear and quadratic cone program solvers" (2010), sections 4
// and 5.
namespace amontons::soc {

using V3 = std::array<double, 3>;

inline double norm1(const V3& s) { return std::sqrt(s[1] * s[1] + s[2] * s[2]); }
// s'Js = s0^2 - |s1|^2, factored so that it does not cancel near the boundary.
inline double det(const V3& s) {
  const double t = norm1(s);
  return (s[0] - t) * (s[0] + t);
}
inline double dot(const V3& a, const V3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline V3 jordan(const V3& a, const V3& b) {
  return {dot(a, b), a[0] * b[1] + b[0] * a[1], a[0] * b[2] + b[0] * a[2]};
}
// x with a o x = c
inline V3 jordan_divide(const V3& a, const V3& c) {
  const double x0 = (a[0] * c[0] - a[1] * c[1] - a[2] * c[2]) / det(a);
  return {x0, (c[1] - x0 * a[1]) / a[0], (c[2] - x0 * a[2]) / a[0]};
}

// Nesterov-Todd scaling: symmetric W with W z = W^-1 s = lambda; W = scale (2 v v' - J), W^-1 = (2 Jv v'J -
// J) / scale.
struct Scaling {
  double scale;
  V3 v, lambda;

  Scaling(const V3& s, const V3& z) {
    const double ds = std::sqrt(det(s)), dz = std::sqrt(det(z));
    V3 a, w;
    for (int k = 0; k < 3; ++k) a[k] = s[k] / ds;
    w = {z[0] / dz, -z[1] / dz, -z[2] / dz};
    const double gamma = std::sqrt(0.5 * (1 + a[0] * w[0] - a[1] * w[1] - a[2] * w[2]));
    for (int k = 0; k < 3; ++k) w[k] = (a[k] + w[k]) / (2 * gamma);
    const double norm = std::sqrt(2 * (w[0] + 1));
    v = {(w[0] + 1) / norm, w[1] / norm, w[2] / norm};
    scale = std::sqrt(ds / dz);
    lambda = times(z);
  }
  V3 times(const V3& x) const {
    const double c = 2 * dot(v, x);
    return {scale * (c * v[0] - x[0]), scale * (c * v[1] + x[1]), scale * (c * v[2] + x[2])};
  }
  V3 inverse_times(const V3& x) const {
    const double c = 2 * (v[0] * x[0] - v[1] * x[1] - v[2] * x[2]);
    return {(c * v[0] - x[0]) / scale, (-c * v[1] + x[1]) / scale, (-c * v[2] + x[2]) / scale};
  }
};

// The largest t with s + t d in the cone (infinity if it never leaves), for s in its interior.
inline double step_to_boundary(const V3& s, const V3& d) {
  // The first positive root of q(t) = det(s + t d) = c + 2 b t + a t^2, and of s0 + t d0.
  const double inf = std::numeric_limits<double>::infinity();
  const double a = det(d), b = s[0] * d[0] - s[1] * d[1] - s[2] * d[2], c = det(s);
  double t = d[0] < 0 ? -s[0] / d[0] : inf;
  const double disc = b * b - a * c;
  if (disc >= 0) {
    const double q = -(b + std::copysign(std::sqrt(disc), b));  // roots q / a and c / q without cancellation
    for (double root : {a != 0 ? q / a : inf, q != 0 ? c / q : inf})
      if (root > 0 && root < t) t = root;
  }
  return t;
}

}  // namespace amontons::soc
