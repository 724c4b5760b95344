#pragma once
#include "amontons/sets/barrier.hpp"
#include "amontons/sets/set.hpp"

namespace amontons {

// The Coulomb-Amontons cone, docs/algorithm.md (13, 14), { (n, t1, t2) : |t| <= mu n }, mu >= 0 and finite.
//
// Projection (Euclidean). With c = 1/sqrt(1 + mu^2), s = mu c, the boundary ray of the half-plane spanned by
// the axis and t is (c, s t/|t|). Three regions:
//   inside  |t| <= mu n          : x itself, bit for bit
//   polar   mu |t| <= -n         : the apex 0
//   else                         : (c n + s |t|) (c, s t/|t|), the foot on the boundary ray.
// Using c and s instead of 1/(1 + mu^2) keeps mu = 0 (the half-line n >= 0) exact and mu up to 1e150 finite.
//
// The fused passes of solvers/first_order/contact_passes.isa.cpp are a second implementation of this set,
// eight contacts at a time; the tests compare the two.
struct Friction {
  static constexpr int dim = 3;
  static constexpr const char* name = "friction";
  static constexpr bool is_cone = true, frictional = true;
  double mu;

  struct Barrier : ConeBarrier<3> {
    Barrier(const Friction& set, double) : ConeBarrier<3>({set.mu, set.mu}) {}
  };

  void project(const double* x, double* out) const {
    const double n = x[0];
    const double t = std::sqrt(x[1] * x[1] + x[2] * x[2]);
    if (mu * t <= -n) {  // first: with mu = 0 the other test is 0 <= -0 on the negative axis
      for (int k = 0; k < 3; ++k) out[k] = 0;
    } else if (t <= mu * n) {
      for (int k = 0; k < 3; ++k) out[k] = x[k];
    } else {
      const double c = 1.0 / std::sqrt(1.0 + mu * mu), s = mu * c;
      const double foot = c * n + s * t;
      // t > 0 here: for t = 0 the point is inside if n >= 0 and polar if n < 0.
      const double scale = foot * s / t;
      out[0] = foot * c;
      out[1] = scale * x[1];
      out[2] = scale * x[2];
    }
  }

  // With the trial point z = x - step it is step + (z - Pi(z)). Outside, z - Pi(z) is the distance c |t| - s
  // n to the boundary ray times its outer normal (-s, c t/|t|).
  void natural_map(const double* x, const double* step, double* out) const {
    const double n = x[0] - step[0], tangent[2] = {x[1] - step[1], x[2] - step[2]};
    const double t = std::sqrt(tangent[0] * tangent[0] + tangent[1] * tangent[1]);
    if (mu * t <= -n) {
      for (int k = 0; k < 3; ++k) out[k] = x[k];
    } else if (t <= mu * n) {
      for (int k = 0; k < 3; ++k) out[k] = step[k];
    } else {
      const double c = 1.0 / std::sqrt(1.0 + mu * mu), s = mu * c;
      const double outside = c * t - s * n;
      out[0] = step[0] - s * outside;
      for (int k = 0; k < 2; ++k) out[k + 1] = step[k + 1] + c * outside / t * tangent[k];
    }
  }

  // Sliding: along the ray of the foot the cone is flat (value 1), along its rim it is curved (foot s / t).
  // Normal to the boundary the projection is constant (0).
  Face<3> face(const double* y) const {
    const double t = std::sqrt(y[1] * y[1] + y[2] * y[2]);
    if (y[0] >= 0 && t <= mu * y[0]) return face_of_all<3>(1);
    if (!(mu * t > -y[0])) return face_of_all<3>(0);
    const double c = 1 / std::sqrt(1 + mu * mu), s = mu * c;
    const double tau[2] = {y[1] / t, y[2] / t};
    return {{1, std::min(1.0, (c * y[0] + s * t) * s / t), 0},
            {{c, s * tau[0], s * tau[1]}, {0, -tau[1], tau[0]}, {s, -c * tau[0], -c * tau[1]}}};
  }

  double violation(const double* u) const { return -u[0]; }
  std::string complaint(std::size_t i) const {
    if (mu >= 0 && std::isfinite(mu)) return {};
    return "friction coefficient mu[" + std::to_string(i) + "] = " + std::to_string(mu) +
           "; it must be finite and not negative";
  }

  // mu |u_t|
  double de_saxce(const double* u) const { return mu * std::sqrt(u[1] * u[1] + u[2] * u[2]); }
  void de_saxce_gradient(const double* u, double* out) const {
    const double t = std::sqrt(u[1] * u[1] + u[2] * u[2]);
    out[0] = 0;
    for (int k = 1; k < 3; ++k) out[k] = t > 0 ? mu * u[k] / t : 0;
  }
  bool has_friction() const { return mu > 0; }
};

}  // namespace amontons
