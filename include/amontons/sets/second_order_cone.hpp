#pragma once
#include <array>
#include <cmath>
#include <limits>

// The second-order cone L = { (s0, s1) : |s1| <= s0 } of n rows as a symmetric cone, with the operations of
// an interior point. L of one row is the half-line. Notation of Vandenberghe, "The CVXOPT linear and
// quadratic cone program solvers" (2010), sections 4 and 5; J = diag(1, -1, ..., -1).
namespace amontons::second_order {

template <std::size_t n>
using V = std::array<double, n>;

template <std::size_t n>
double tail(const V<n>& s) {  // |s1|
  double sum = 0;
  for (std::size_t k = 1; k < n; ++k) sum += s[k] * s[k];
  return std::sqrt(sum);
}

// s'Js = s0^2 - |s1|^2, factored to avoid cancellation near the boundary.
template <std::size_t n>
double det(const V<n>& s) {
  const double t = tail(s);
  return (s[0] - t) * (s[0] + t);
}

template <std::size_t n>
double dot(const V<n>& a, const V<n>& b) {
  double sum = a[0] * b[0];
  for (std::size_t k = 1; k < n; ++k) sum += a[k] * b[k];
  return sum;
}

// a'J b
template <std::size_t n>
double dot_J(const V<n>& a, const V<n>& b) {
  double sum = a[0] * b[0];
  for (std::size_t k = 1; k < n; ++k) sum -= a[k] * b[k];
  return sum;
}

// The Jordan product a o b = (<a, b>, a0 b1 + b0 a1).
template <std::size_t n>
V<n> jordan(const V<n>& a, const V<n>& b) {
  V<n> c{dot(a, b)};
  for (std::size_t k = 1; k < n; ++k) c[k] = a[0] * b[k] + b[0] * a[k];
  return c;
}

// x with a o x = c
template <std::size_t n>
V<n> jordan_divide(const V<n>& a, const V<n>& c) {
  V<n> x{dot_J(a, c) / det(a)};
  for (std::size_t k = 1; k < n; ++k) x[k] = (c[k] - x[0] * a[k]) / a[0];
  return x;
}

// Nesterov-Todd scaling: the symmetric W with W z = W^-1 s = lambda; W = scale (2 v v' - J) and W^-1 =
// (2 Jv v'J - J) / scale.
template <std::size_t n>
struct Scaling {
  double scale = 1;
  V<n> v{1}, lambda{1};

  Scaling() = default;
  Scaling(const V<n>& s, const V<n>& z) {
    // v is the square root, in the Jordan algebra, of the point half-way between s and z on the hyperboloid
    // of determinant one.
    const double ds = std::sqrt(det(s)), dz = std::sqrt(det(z));
    V<n> a, w;
    for (std::size_t k = 0; k < n; ++k) a[k] = s[k] / ds;
    for (std::size_t k = 0; k < n; ++k) w[k] = (k == 0 ? z[k] : -z[k]) / dz;
    double aJw = 1 + a[0] * w[0];
    for (std::size_t k = 1; k < n; ++k) aJw -= a[k] * w[k];
    const double gamma = std::sqrt(0.5 * aJw);
    for (std::size_t k = 0; k < n; ++k) w[k] = (a[k] + w[k]) / (2 * gamma);
    const double norm = std::sqrt(2 * (w[0] + 1));
    v[0] = (w[0] + 1) / norm;
    for (std::size_t k = 1; k < n; ++k) v[k] = w[k] / norm;
    scale = std::sqrt(ds / dz);
    lambda = times(z);
  }
  V<n> times(const V<n>& x) const {
    const double c = 2 * dot(v, x);
    V<n> y{scale * (c * v[0] - x[0])};
    for (std::size_t k = 1; k < n; ++k) y[k] = scale * (c * v[k] + x[k]);
    return y;
  }
  V<n> inverse_times(const V<n>& x) const {
    const double c = 2 * dot_J(v, x);
    V<n> y{(c * v[0] - x[0]) / scale};
    for (std::size_t k = 1; k < n; ++k) y[k] = (-c * v[k] + x[k]) / scale;
    return y;
  }
};

// The largest t with s + t d in the cone (infinity if the ray never leaves), for s in its interior. It is the
// first positive root of q(t) = det(s + t d) = c + 2 b t + a t^2, and of s0 + t d0.
template <std::size_t n>
double step_to_boundary(const V<n>& s, const V<n>& d) {
  const double inf = std::numeric_limits<double>::infinity();
  const double a = det(d), b = dot_J(s, d), c = det(s);
  double t = d[0] < 0 ? -s[0] / d[0] : inf;
  const double disc = b * b - a * c;
  if (disc >= 0) {
    const double q = -(b + std::copysign(std::sqrt(disc), b));  // roots q / a and c / q without cancellation
    for (double root : {a != 0 ? q / a : inf, q != 0 ? c / q : inf})
      if (root > 0 && root < t) t = root;
  }
  return t;
}

}  // namespace amontons::second_order
