#pragma once
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>

namespace amontons {

// The derivative of a projection by its eigenvalues and eigenvectors, Q = sum_k value[k] vector[k]
// vector[k]'. Pi is the gradient of a convex function and nonexpansive, so Q is symmetric and 0 <= value <=
// 1.
template <int n>
struct Face {
  double value[n];
  double vector[n][n];
};

// The operations that solvers require of a set. A new set is one file with a struct of this form and an entry
// in sets.hpp. Nothing else in the C++ core lists sets, except kernels that implement one of them a second
// time (Friction, in solvers/first_order).
//
//   dim, name        rows of a block; the name of the set in files and Python
//   is_cone          0 in the set and closed under scaling; otherwise project_recession(d, out) gives the
//                    directions in which it is unbounded
//   frictional       the block of a contact: has a De Saxce term
//   project(x, out)  out = Pi(x), Euclidean; x and out may be the same memory
//   natural_map(x, step, out)
//                    out = x - Pi(x - step), formed without cancellation: if the trial point is inside, it is
//                    `step` itself, however large x is. Otherwise a method whose impulses diverge to 1e16
//                    would seem converged, because x - step rounds to x.
//   face(y)          Pi'(y), an element of the generalised Jacobian, for the semismooth Newton method
//   violation(u)     the speed (m/s) at which u violates the constraint, negative if it separates
//   complaint(i)     the error in the user's parameters of block i; empty if they are valid
//   de_saxce(u)         for frictional sets: the term that turns the VI into Coulomb's law, g = u +
//   de_saxce(u) e_n
//                    (De Saxce 1992). The dual cone is { u_n >= de_saxce(u) }: it contains g if u_n >= 0.
//   de_saxce_gradient(u, out)  its derivative with respect to u, dim entries
//   has_friction()   for frictional sets: whether the term can be nonzero
//   Barrier          the block in an interior-point method: see barrier.hpp
//
// A set is an aggregate of doubles, its parameters, in the order in which files and Python give them.
template <class S>
concept Set = std::is_trivially_copyable_v<S> && requires(const S& set, const double* x, double* out) {
  { S::dim } -> std::convertible_to<int>;
  { S::name } -> std::convertible_to<const char*>;
  { S::is_cone } -> std::convertible_to<bool>;
  { S::frictional } -> std::convertible_to<bool>;
  set.project(x, out);
  set.natural_map(x, x, out);
  { set.face(x) } -> std::same_as<Face<S::dim>>;
  { set.violation(x) } -> std::same_as<double>;
  { set.complaint(std::size_t{}) } -> std::same_as<std::string>;
  typename S::Barrier;
};

template <class S>
inline constexpr std::size_t parameter_count = std::is_empty_v<S> ? 0 : sizeof(S) / sizeof(double);
template <class S>
std::array<double, parameter_count<S>> parameters(const S& set) {
  std::array<double, parameter_count<S>> values{};
  if constexpr (parameter_count<S> > 0) std::memcpy(values.data(), &set, sizeof set);
  return values;
}
template <class S>
S from_parameters(const std::array<double, parameter_count<S>>& values) {
  S set;
  if constexpr (parameter_count<S> > 0) std::memcpy(&set, values.data(), sizeof set);
  return set;
}

// The natural map of any cone. On the boundary Pi(z) = <z, ray> ray with ray = Pi(z) / |Pi(z)|, because z -
// Pi(z) is orthogonal to Pi(z) (Moreau). Hence x - Pi(x - step) = (x - <x, ray> ray) + <step, ray> ray.
template <class S>
void natural_map_of_cone(const S& set, const double* x, const double* step, double* out) {
  double z[S::dim], foot[S::dim], size = 0;
  bool inside = true;
  for (int k = 0; k < S::dim; ++k) z[k] = x[k] - step[k];
  set.project(z, foot);
  for (int k = 0; k < S::dim; ++k) {
    inside = inside && foot[k] == z[k];
    size += foot[k] * foot[k];
  }
  if (inside || !(size > 0)) {
    for (int k = 0; k < S::dim; ++k) out[k] = inside ? step[k] : x[k];
    return;
  }
  double along_x = 0, along_step = 0;
  for (int k = 0; k < S::dim; ++k) {
    along_x += foot[k] * x[k];
    along_step += foot[k] * step[k];
  }
  for (int k = 0; k < S::dim; ++k) out[k] = (x[k] - along_x / size * foot[k]) + along_step / size * foot[k];
}

// The derivative inside the set, Q = identity, and at the apex, Q = 0.
template <int n>
Face<n> face_of_all(double value) {
  Face<n> face{};
  for (int k = 0; k < n; ++k) {
    face.value[k] = value;
    face.vector[k][k] = 1;
  }
  return face;
}

// The eigenvalues and eigenvectors of a symmetric matrix by cyclic Jacobi rotations (Golub, Van Loan, "Matrix
// Computations", 8.5), for the few rows of a block; values clipped to [0, 1].
template <int n>
Face<n> face_of(double (&Q)[n][n]) {
  double V[n][n] = {};
  for (int k = 0; k < n; ++k) V[k][k] = 1;
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0, diagonal = 0;
    for (int i = 0; i < n; ++i) {
      diagonal += Q[i][i] * Q[i][i];
      for (int j = 0; j < i; ++j) off += Q[i][j] * Q[i][j];
    }
    if (off <= 1e-32 * diagonal) break;
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        if (Q[p][q] == 0) continue;
        const double theta = (Q[q][q] - Q[p][p]) / (2 * Q[p][q]);
        const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(1 + theta * theta));
        const double c = 1 / std::sqrt(1 + t * t), s = t * c;
        const auto rotate = [&](double& a, double& b) {
          const double old = a;
          a = c * old - s * b;
          b = s * old + c * b;
        };
        for (int k = 0; k < n; ++k) rotate(Q[k][p], Q[k][q]);
        for (int k = 0; k < n; ++k) rotate(Q[p][k], Q[q][k]);
        for (int k = 0; k < n; ++k) rotate(V[k][p], V[k][q]);
      }
  }
  Face<n> face;
  for (int k = 0; k < n; ++k) {
    face.value[k] = std::fmin(1.0, std::fmax(0.0, Q[k][k]));
    for (int i = 0; i < n; ++i) face.vector[k][i] = V[i][k];
  }
  return face;
}

}  // namespace amontons
